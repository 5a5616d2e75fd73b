//! Writes a built-in scene's model as OBJ for other programs. `cargo run --release --example
//! built_in_model room out/room` writes `out/room.obj` and `out/room.mtl`. An optional last
//! argument is the number of triangles.

use std::fs::File;
use std::io::{BufWriter, Write};

use lightpaths::scene::{LoadOptions, Scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, path, triangles) = match &arguments[..] {
        [name, path] => (name, path, None),
        [name, path, triangles] => (name, path, Some(triangles)),
        _ => return Err("usage: built_in_model SCENE PATH [TRIANGLES]".into()),
    };
    let set = triangles.map(|count| format!("model.0.triangles={count}")).into_iter().collect();
    let scene = Scene::load(name, &LoadOptions { set, ..LoadOptions::default() })?;

    let mut library = BufWriter::new(File::create(format!("{path}.mtl"))?);
    for material in &scene.materials {
        let [r, g, b] = material.diffuse.to_array();
        writeln!(library, "newmtl {}\nKd {r} {g} {b}\n", material.name)?;
    }
    library.flush()?;

    let stem = std::path::Path::new(path).file_name().ok_or("PATH must end in a name")?.to_string_lossy();
    let mut model = BufWriter::new(File::create(format!("{path}.obj"))?);
    writeln!(model, "mtllib {stem}.mtl")?;
    let mut material = u32::MAX;
    for triangle in &scene.triangles {
        if triangle.material != material {
            material = triangle.material;
            writeln!(model, "usemtl {}", scene.materials[material as usize].name)?;
        }
        for p in triangle.positions {
            let p = p.as_dvec3() + scene.origin;
            writeln!(model, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for n in triangle.normals {
            writeln!(model, "vn {} {} {}", n.x, n.y, n.z)?;
        }
        writeln!(model, "f -3//-3 -2//-2 -1//-1")?;
    }
    model.flush()?;
    Ok(())
}
