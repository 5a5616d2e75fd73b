//! The light meters of a scene file as the window edits them.

use glam::{DVec3, Vec3};

use super::edits::{direction, place, set_text, vector};
use super::node;
use crate::scene::meter::{Meter, MeterPoint, MeterShape, standard_grid};
use crate::scene::value::{Kind, Node};

/// Replaces the list of meters. Returns the index of each in the old list.
pub(super) fn write(root: &mut Node, meters: &[Meter], origin: DVec3) -> Vec<Option<usize>> {
    let old = match root.get("meter") {
        Some(Node { kind: Kind::Array(tables), .. }) => tables.clone(),
        _ => Vec::new(),
    };
    let name_of = |(number, table): (usize, &Node)| {
        table.get("name").and_then(Node::as_text).map_or_else(|| Meter::unnamed(number), str::to_owned)
    };
    let names: Vec<String> = old.iter().enumerate().map(name_of).collect();
    let from: Vec<Option<usize>> =
        meters.iter().map(|meter| names.iter().position(|name| *name == meter.name)).collect();
    if meters.is_empty() && old.is_empty() {
        return from;
    }
    let tables = meters.iter().zip(&from).enumerate().map(|(number, (meter, from))| {
        let mut table = from.map_or_else(|| node(Kind::Table(Vec::new())), |index| old[index].clone());
        edit(&mut table, meter, number, origin);
        table
    });
    root.set("meter", node(Kind::Array(tables.collect())));
    from
}

fn edit(table: &mut Node, meter: &Meter, number: usize, origin: DVec3) {
    let word = match &meter.shape {
        MeterShape::Point { .. } => "point",
        MeterShape::Plane { .. } => "plane",
        MeterShape::Region { .. } => "region",
    };
    if table.get("name").is_some() || meter.name != Meter::unnamed(number) {
        set_text(table, "name", &meter.name);
    }
    if table.get("kind").and_then(Node::as_text) != Some(word) {
        if let Kind::Table(entries) = &mut table.kind {
            entries.retain(|(key, _)| key == "name");
        }
        set_text(table, "kind", word);
    }
    match meter.shape {
        MeterShape::Region { ref points } => {
            list(table, "points", points, |one, (at, _)| place(one, "points", *at, origin));
            list(table, "normals", points, |one, (_, normal)| direction(one, "normals", *normal));
        }
        MeterShape::Point { position, normal } => {
            place(table, "position", position, origin);
            direction(table, "normal", normal);
        }
        MeterShape::Plane { corner, edge_u, edge_v, grid } => {
            place(table, "corner", corner, origin);
            vector(table, "edge_u", edge_u);
            vector(table, "edge_v", edge_v);
            let length = |edge: Vec3| f64::from(edge.length());
            if table.get("grid").is_some() || grid != standard_grid([length(edge_u), length(edge_v)]) {
                let numbers = grid.map(|count| node(Kind::Integer(count.into())));
                table.set("grid", node(Kind::Array(numbers.into())));
            }
        }
    }
}

/// Replaces a list of vectors. `write` sets the vector of one point under the same key, and keeps
/// numbers that are still right.
fn list(table: &mut Node, key: &str, points: &[MeterPoint], write: impl Fn(&mut Node, &MeterPoint)) {
    let old = match table.get(key).map(|list| &list.kind) {
        Some(Kind::Array(old)) => &old[..],
        _ => &[],
    };
    let element = |(number, point): (usize, &MeterPoint)| {
        let mut one = node(Kind::Table(Vec::new()));
        if let Some(old) = old.get(number) {
            one.set(key, old.clone());
        }
        write(&mut one, point);
        one.get(key).cloned()
    };
    let elements = points.iter().enumerate().filter_map(element).collect();
    table.set(key, node(Kind::Array(elements)));
}
