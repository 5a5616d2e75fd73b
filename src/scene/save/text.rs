//! Updates a TOML text to a changed tree of values. Unchanged parts keep their
//! text, including comments.

use std::path::Path;

use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::node;
use crate::scene::numbers;
use crate::scene::value::{Kind, Node};
use crate::{Error, Result};

/// The text of `root`. `from` has lists by name, each with the old index of every element.
pub(super) fn write(text: &str, root: &Node, from: &[(&str, Vec<Option<usize>>)]) -> Result<String> {
    let mut document: DocumentMut =
        text.parse().map_err(|_| Error::input(Path::new("scene"), "is not TOML: load it again"))?;
    let Kind::Table(sections) = &root.kind else { return Ok(text.to_owned()) };
    for (key, section) in sections {
        let found = from.iter().find(|(list, _)| list == key).map(|(_, from)| from.clone());
        if let Kind::Array(elements) = &section.kind {
            let from = found.unwrap_or_else(|| (0..elements.len()).map(Some).collect());
            write_list(&mut document, key, elements, &from);
        } else if let Some(item) = document.get_mut(key) {
            write_item(item, section);
        } else {
            document.insert(key, Item::Table(new_table(section)));
        }
    }
    Ok(document.to_string())
}

fn write_list(document: &mut DocumentMut, key: &str, elements: &[Node], from: &[Option<usize>]) {
    let old = document.get(key);
    let before = old.map_or_else(|| node(Kind::Array(Vec::new())), tree);
    let Kind::Array(before) = &before.kind else { return };
    let stays = from.iter().enumerate().all(|(index, from)| *from == Some(index));
    if stays && before.len() == elements.len() && before.iter().zip(elements).all(|(a, b)| is_same(a, b)) {
        return;
    }
    // A list of tables leaves nothing when its last one goes. A reader would take the scene for one
    // whose lights were forgotten.
    if key == "light" && elements.is_empty() {
        document.remove(key);
        document.insert(key, Item::Value(Value::Array(Array::new())));
        return;
    }
    // Tables stand elsewhere than a value does.
    if document.get(key).is_some_and(Item::is_value) {
        document.remove(key);
    }
    let old = std::mem::take(&mut document[key]).into_array_of_tables().unwrap_or_default();
    let old: Vec<&Table> = old.iter().collect();
    // A table's position in the text is a number. Kept tables get the old numbers in the new order.
    let kept = from.iter().filter_map(|from| old.get((*from)?)?.position());
    let mut places: Vec<isize> = kept.collect();
    places.sort_unstable();
    let mut places = places.into_iter();
    let mut tables = ArrayOfTables::new();
    for (element, from) in elements.iter().zip(from) {
        let table = from.and_then(|index| old.get(index)).map(|&table| {
            let mut table = table.clone();
            let place = table.position().and_then(|_| places.next());
            table.set_position(place);
            write_table(&mut table, element);
            table
        });
        tables.push(table.unwrap_or_else(|| new_table(element)));
    }
    document[key] = Item::ArrayOfTables(tables);
}

fn write_table(table: &mut dyn TableLike, after: &Node) {
    let Kind::Table(entries) = &after.kind else { return };
    let names: Vec<String> = table.iter().map(|(name, _)| name.to_owned()).collect();
    for name in names.iter().filter(|name| after.get(name).is_none()) {
        table.remove(name);
    }
    for (key, node) in entries {
        match table.get_mut(key) {
            Some(item) => write_item(item, node),
            None => {
                table.insert(key, Item::Value(value(node)));
            }
        }
    }
}

fn write_item(item: &mut Item, after: &Node) {
    if is_same(&tree(item), after) {
        return;
    }
    if let (Kind::Table(_), Some(table)) = (&after.kind, item.as_table_like_mut()) {
        return write_table(table, after);
    }
    match item {
        Item::Value(old) => write_value(old, after),
        _ => *item = Item::Value(value(after)),
    }
}

fn write_value(old: &mut Value, after: &Node) {
    if is_same(&tree(&Item::Value(old.clone())), after) {
        return;
    }
    if let (Value::Array(array), Kind::Array(elements)) = (&mut *old, &after.kind)
        && array.len() == elements.len()
    {
        array.iter_mut().zip(elements).for_each(|(value, node)| write_value(value, node));
        return;
    }
    let decor = old.decor().clone();
    *old = value(after);
    *old.decor_mut() = decor;
}

/// A table that follows the existing ones.
fn new_table(node: &Node) -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix("\n");
    write_table(&mut table, node);
    table
}

fn value(node: &Node) -> Value {
    match &node.kind {
        Kind::Table(entries) => {
            let entries = entries.iter().map(|(key, node)| (key.as_str(), value(node)));
            Value::InlineTable(entries.collect::<InlineTable>())
        }
        Kind::Array(elements) => Value::Array(elements.iter().map(value).collect::<Array>()),
        Kind::Integer(number) => Value::from(*number),
        // The library would write out all zeros of 1e-20.
        Kind::Float(number) => numbers::text(*number).parse().unwrap_or_else(|_| Value::from(*number)),
        Kind::Text(text) => Value::from(text.as_str()),
        Kind::Bool(flag) => Value::from(*flag),
        // No key of a scene file is a time, and unread values are not changed.
        Kind::Time => Value::from(""),
    }
}

fn tree(item: &Item) -> Node {
    Node::item(item, node(Kind::Time).origin, &|_| 1)
}

fn is_same(a: &Node, b: &Node) -> bool {
    match (&a.kind, &b.kind) {
        (Kind::Table(a), Kind::Table(_)) if a.len() != count(b) => false,
        (Kind::Table(a), Kind::Table(_)) => {
            a.iter().all(|(key, a)| b.get(key).is_some_and(|b| is_same(a, b)))
        }
        (Kind::Array(a), Kind::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b)),
        (Kind::Integer(a), Kind::Integer(b)) => a == b,
        (Kind::Float(a), Kind::Float(b)) => a.to_bits() == b.to_bits(),
        (Kind::Text(a), Kind::Text(b)) => a == b,
        (Kind::Bool(a), Kind::Bool(b)) => a == b,
        (Kind::Time, Kind::Time) => true,
        _ => false,
    }
}

fn count(table: &Node) -> usize {
    if let Kind::Table(entries) = &table.kind { entries.len() } else { 0 }
}
