//! A scene file as a tree whose values carry their origin, and typed, checked access to it.
//!
//! Values from the file and from the command line pass the same checks. An error names the line of
//! the file, or the flag.

use std::ops::RangeInclusive;
use std::path::Path;

use glam::DVec3;
use toml_edit::{Item, TableLike, Value};

use super::limits::NAME_BYTES;
use super::words::one_line;
pub(super) use super::words::{excerpt, printable, unknown};
use crate::{Error, Result};

/// Coordinates and lengths, metres.
pub(super) const COORDINATE: RangeInclusive<f64> = -1e12..=1e12;
pub(super) const POWER: RangeInclusive<f64> = 0.0..=1e15;

/// The origin of a value, for error messages.
#[derive(Clone, Debug)]
pub(super) enum Origin {
    /// A line of the scene file, 1-based.
    Line(usize),
    /// The command line, as typed.
    Flag(String),
}

/// A value with its origin.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) origin: Origin,
    pub(super) kind: Kind,
}

/// The types of TOML values.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Table(Vec<(String, Node)>),
    Array(Vec<Node>),
    Integer(i64),
    Float(f64),
    Text(String),
    Bool(bool),
    Time,
}

impl Node {
    /// Parses the text of `file`. Fails with the parser's message and line if it is not TOML.
    pub(super) fn parse(file: &Path, text: &str) -> Result<Self> {
        let line_starts: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
        let line_of = |at: usize| 1 + line_starts.partition_point(|&newline| newline < at);
        let document = toml_edit::Document::parse(text).map_err(|fault| Error::Input {
            file: file.to_owned(),
            line: fault.span().map(|span| line_of(span.start)),
            message: format!("is not TOML: {}", one_line(fault.message())),
        })?;
        Ok(Self::table(document.as_table(), Origin::Line(1), &line_of))
    }

    /// Parses one value from the command line. An unquoted word counts as a string, since
    /// shells remove quotes.
    pub(super) fn parse_flag(flag: &str, text: &str) -> Result<Self> {
        let is_word = text.starts_with(char::is_alphabetic)
            && text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.'));
        let origin = Origin::Flag(flag.to_owned());
        match text.parse::<Value>() {
            Ok(value) => Ok(Self::value(&value, origin, &|_| 1).blamed_on(flag)),
            Err(_) if is_word => Ok(Self { origin, kind: Kind::Text(text.to_owned()) }),
            Err(fault) => {
                Err(Error::Usage(format!("{flag}: the value is not TOML: {}", one_line(&fault.to_string()))))
            }
        }
    }

    fn table(table: &dyn TableLike, origin: Origin, line_of: &dyn Fn(usize) -> usize) -> Self {
        let entries = table.iter().map(|(name, item)| {
            let span = table.key(name).and_then(toml_edit::Key::span).or_else(|| item.span());
            let origin = span.map_or(origin.clone(), |span| Origin::Line(line_of(span.start)));
            (name.to_owned(), Self::item(item, origin, line_of))
        });
        Self { kind: Kind::Table(entries.collect()), origin: origin.clone() }
    }

    pub(super) fn item(item: &Item, origin: Origin, line_of: &dyn Fn(usize) -> usize) -> Self {
        match item {
            Item::None => Self { origin, kind: Kind::Table(Vec::new()) },
            Item::Value(value) => Self::value(value, origin, line_of),
            Item::Table(table) => Self::table(table, origin, line_of),
            Item::ArrayOfTables(tables) => {
                let elements = tables.iter().map(|table| {
                    let span = table.span();
                    let origin = span.map_or(origin.clone(), |span| Origin::Line(line_of(span.start)));
                    Self::table(table, origin, line_of)
                });
                Self { kind: Kind::Array(elements.collect()), origin: origin.clone() }
            }
        }
    }

    fn value(value: &Value, origin: Origin, line_of: &dyn Fn(usize) -> usize) -> Self {
        let kind = match value {
            Value::String(text) => Kind::Text(text.value().clone()),
            Value::Integer(number) => Kind::Integer(*number.value()),
            Value::Float(number) => Kind::Float(*number.value()),
            Value::Boolean(flag) => Kind::Bool(*flag.value()),
            Value::Datetime(_) => Kind::Time,
            Value::InlineTable(table) => return Self::table(table, origin, line_of),
            Value::Array(array) => Kind::Array(
                array
                    .iter()
                    .map(|element| {
                        let span = element.span();
                        let origin = span.map_or(origin.clone(), |span| Origin::Line(line_of(span.start)));
                        Self::value(element, origin, line_of)
                    })
                    .collect(),
            ),
        };
        Self { origin, kind }
    }

    /// The value with a flag as the origin of all its parts.
    pub(super) fn blamed_on(mut self, flag: &str) -> Self {
        self.origin = Origin::Flag(flag.to_owned());
        self.kind = match self.kind {
            Kind::Array(elements) => Kind::Array(elements.into_iter().map(|e| e.blamed_on(flag)).collect()),
            Kind::Table(entries) => {
                Kind::Table(entries.into_iter().map(|(name, node)| (name, node.blamed_on(flag))).collect())
            }
            leaf => leaf,
        };
        self
    }

    /// The elements of a list of that length. `None` if it is another value, or an element is.
    pub(super) fn as_list<T, const COUNT: usize>(
        &self,
        read: impl Fn(&Self) -> Option<T>,
    ) -> Option<[T; COUNT]> {
        let Kind::Array(elements) = &self.kind else { return None };
        let elements: Option<Vec<T>> = elements.iter().map(read).collect();
        elements?.try_into().ok()
    }

    /// The numbers of a list of that length. `None` if it is another value.
    pub(super) fn as_numbers<const COUNT: usize>(&self) -> Option<[f64; COUNT]> {
        self.as_list(Self::as_number)
    }

    /// The entry of that name. `None` if this is no table, or lacks it.
    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        let Kind::Table(entries) = &self.kind else { return None };
        entries.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// The mutable entry of that name. `None` if this is no table, or lacks it.
    pub(super) fn get_mut(&mut self, key: &str) -> Option<&mut Self> {
        let Kind::Table(entries) = &mut self.kind else { return None };
        entries.iter_mut().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// Adds or replaces an entry of a table. Other types stay unchanged; a later
    /// check refuses them.
    pub(super) fn set(&mut self, key: &str, value: Self) {
        if let Some(old) = self.get_mut(key) {
            *old = value;
        } else if let Kind::Table(entries) = &mut self.kind {
            entries.push((key.to_owned(), value));
        }
    }

    /// The text. `None` if this is another type.
    pub(super) fn as_text(&self) -> Option<&str> {
        if let Kind::Text(text) = &self.kind { Some(text) } else { None }
    }

    fn describe(&self) -> String {
        match &self.kind {
            Kind::Table(_) => "a table".into(),
            Kind::Array(elements) => format!("a list of {}", elements.len()),
            Kind::Integer(number) => format!("{number}"),
            Kind::Float(number) => format!("{number:?}"),
            Kind::Text(text) => format!("the string {}", excerpt(text)),
            Kind::Bool(flag) => format!("{flag}"),
            Kind::Time => "a date or time".into(),
        }
    }

    pub(super) fn as_number(&self) -> Option<f64> {
        match self.kind {
            Kind::Integer(number) => Some(number as f64),
            Kind::Float(number) => Some(number),
            _ => None,
        }
    }
}

/// A table of the scene file, with its dotted path as in `--set`.
pub(super) struct Section<'a> {
    file: &'a Path,
    path: String,
    node: &'a Node,
}

impl<'a> Section<'a> {
    /// Fails if `node` is not a table.
    pub(super) fn new(file: &'a Path, path: impl Into<String>, node: &'a Node) -> Result<Self> {
        let section = Self { file, path: path.into(), node };
        match node.kind {
            Kind::Table(_) => Ok(section),
            _ => Err(section.fault(format!("a table was expected, found {}", node.describe()))),
        }
    }

    /// The elements of the list of tables `root.key`, at most `most`. Empty if the key is absent.
    pub(super) fn list(file: &'a Path, root: &'a Node, key: &str, most: usize) -> Result<Vec<Self>> {
        let Some(node) = root.get(key) else { return Ok(Vec::new()) };
        let Kind::Array(elements) = &node.kind else {
            let section = Self { file, path: key.to_owned(), node };
            return Err(section.fault(format!("must be a list of tables: write [[{key}]]")));
        };
        if elements.len() > most {
            let section = Self { file, path: key.to_owned(), node: &elements[most] };
            return Err(section.fault(format!("{} of them are too many: {most} at most", elements.len())));
        }
        let named = |(index, element): (usize, &'a Node)| {
            let name = element.get("name").and_then(Node::as_text).map_or(index.to_string(), printable);
            Self::new(file, format!("{key}.{name}"), element)
        };
        elements.iter().enumerate().map(named).collect()
    }

    /// An error about the whole table.
    pub(super) fn fault(&self, message: impl std::fmt::Display) -> Error {
        blame(self.file, &self.node.origin, format!("{}: {message}", self.path))
    }

    /// An error about one of its keys, present or not.
    pub(super) fn fault_at(&self, key: &str, message: impl std::fmt::Display) -> Error {
        let origin = self.get(key).map_or(&self.node.origin, |node| &node.origin);
        let path = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
        blame(self.file, origin, format!("{path}: {message}"))
    }

    /// Refuses keys outside of `keys`, and suggests the nearest valid one.
    pub(super) fn only(&self, keys: &[&str]) -> Result<()> {
        let Kind::Table(entries) = &self.node.kind else { return Ok(()) };
        match entries.iter().find(|(name, _)| !keys.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, _)) => Err(self.fault_at(&printable(name), unknown("key", keys, name))),
        }
    }

    /// The value without a check.
    pub(super) fn get(&self, key: &str) -> Option<&'a Node> {
        self.node.get(key)
    }

    /// The file of the table.
    pub(super) fn file(&self) -> &'a Path {
        self.file
    }

    /// A copy of the table without some keys, for readers that do not support them.
    pub(super) fn without(&self, keys: &[&str]) -> Node {
        let mut node = self.node.clone();
        if let Kind::Table(entries) = &mut node.kind {
            entries.retain(|(name, _)| !keys.contains(&name.as_str()));
        }
        node
    }

    /// Turns an absent value into an error that names the expected one.
    pub(super) fn need<T>(&self, value: Option<T>, key: &str, expected: &str) -> Result<T> {
        value.ok_or_else(|| self.fault(format!("the key `{key}` is missing ({expected})")))
    }

    fn expected(&self, key: &str, expected: &str, node: &Node) -> Error {
        self.fault_at(key, format!("{expected} was expected, found {}", node.describe()))
    }

    /// A finite number in `range`.
    pub(super) fn number(&self, key: &str, range: RangeInclusive<f64>) -> Result<Option<f64>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        let number = node.as_number().ok_or_else(|| self.expected(key, "a number", node))?;
        self.check_range(key, number, &range).map(Some)
    }

    fn check_range(&self, key: &str, number: f64, range: &RangeInclusive<f64>) -> Result<f64> {
        if !number.is_finite() {
            return Err(self.fault_at(key, format!("{number} is not a finite number")));
        }
        if !range.contains(&number) {
            let (low, high) = (range.start(), range.end());
            return Err(
                self.fault_at(key, format!("{number:?} is out of range: {low:?} to {high:?} expected"))
            );
        }
        Ok(number)
    }

    /// A whole number in `range`.
    pub(super) fn integer(&self, key: &str, range: RangeInclusive<u32>) -> Result<Option<u32>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        let Kind::Integer(number) = node.kind else { return Err(self.expected(key, "a whole number", node)) };
        self.check_integer(key, number, &range).map(Some)
    }

    fn check_integer(&self, key: &str, number: i64, range: &RangeInclusive<u32>) -> Result<u32> {
        u32::try_from(number).ok().filter(|number| range.contains(number)).ok_or_else(|| {
            let (low, high) = (range.start(), range.end());
            self.fault_at(key, format!("{number} is out of range: {low} to {high} expected"))
        })
    }

    /// Three finite numbers, each in `range`.
    pub(super) fn vector(&self, key: &str, range: RangeInclusive<f64>) -> Result<Option<DVec3>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        let numbers = node.as_numbers().ok_or_else(|| self.expected(key, "a list of three numbers", node))?;
        self.check_vector(key, numbers, &range).map(Some)
    }

    /// A list of vectors, of three finite numbers in `range` each.
    pub(super) fn vectors(&self, key: &str, range: RangeInclusive<f64>) -> Result<Option<Vec<DVec3>>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        let fault = || self.expected(key, "a list of lists of three numbers", node);
        let Kind::Array(elements) = &node.kind else { return Err(fault()) };
        let vector = |element: &Node| self.check_vector(key, element.as_numbers().ok_or_else(fault)?, &range);
        elements.iter().map(vector).collect::<Result<_>>().map(Some)
    }

    fn check_vector(&self, key: &str, numbers: [f64; 3], range: &RangeInclusive<f64>) -> Result<DVec3> {
        numbers.iter().try_for_each(|&number| self.check_range(key, number, range).map(drop))?;
        Ok(DVec3::from(numbers))
    }

    /// Four rows of four finite numbers, each in `range`.
    pub(super) fn matrix(&self, key: &str, range: RangeInclusive<f64>) -> Result<Option<[[f64; 4]; 4]>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        let Some(rows) = node.as_list(Node::as_numbers) else {
            return Err(self.expected(key, "a list of four rows of four numbers", node));
        };
        for number in rows.into_iter().flatten() {
            self.check_range(key, number, &range)?;
        }
        Ok(Some(rows))
    }

    /// Width and height in pixels.
    pub(super) fn size(&self, key: &str, range: RangeInclusive<u32>) -> Result<Option<[u32; 2]>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        match &node.kind {
            Kind::Array(elements) => match elements.as_slice() {
                [Node { kind: Kind::Integer(w), .. }, Node { kind: Kind::Integer(h), .. }] => {
                    let [w, h] = [*w, *h].map(|number| self.check_integer(key, number, &range));
                    Ok(Some([w?, h?]))
                }
                _ => Err(self.expected(key, "a list of two whole numbers", node)),
            },
            _ => Err(self.expected(key, "a list of two whole numbers", node)),
        }
    }

    /// A string: not empty, not too long, without control characters. It may be printed, or
    /// open a file.
    pub(super) fn text(&self, key: &str) -> Result<Option<&'a str>> {
        let Some(node) = self.get(key) else { return Ok(None) };
        let text = node.as_text().ok_or_else(|| self.expected(key, "a string", node))?;
        if text.is_empty() || text.contains(char::is_control) {
            return Err(self.expected(key, "a printable string", node));
        }
        if text.len() > NAME_BYTES {
            return Err(self.fault_at(key, format!("has {} bytes, {NAME_BYTES} at most", text.len())));
        }
        Ok(Some(text))
    }

    /// True or false.
    pub(super) fn flag(&self, key: &str) -> Result<Option<bool>> {
        match self.get(key) {
            None => Ok(None),
            Some(Node { kind: Kind::Bool(flag), .. }) => Ok(Some(*flag)),
            Some(node) => Err(self.expected(key, "true or false", node)),
        }
    }

    /// A unit vector from three numbers that are not all zero. A vector of unit length up to f32
    /// rounding is kept, so that a written direction is read back bit for bit.
    pub(super) fn direction(&self, key: &str) -> Result<Option<DVec3>> {
        let Some(vector) = self.vector(key, COORDINATE)? else { return Ok(None) };
        unit(vector).map(Some).ok_or_else(|| self.fault_at(key, "a direction must not be zero"))
    }
}

/// The direction of three numbers. `None` if all are zero.
pub(super) fn unit(vector: DVec3) -> Option<DVec3> {
    let is_unit = (vector.length() - 1.0).abs() <= 4.0 * f64::from(f32::EPSILON);
    if is_unit { Some(vector) } else { vector.try_normalize() }
}

fn blame(file: &Path, origin: &Origin, message: String) -> Error {
    match origin {
        Origin::Line(line) => Error::input_at(file, *line, message),
        Origin::Flag(flag) => Error::Usage(format!("{flag}: {message}")),
    }
}
