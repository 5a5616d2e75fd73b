//! Checks beyond the compiler's: Rust, GLSL and the committed SPIR-V agree, and module layers
//! import in one direction.
//!
//! With the feature `shaderc` and `LIGHTPATHS_BLESS=1` in the environment, `spirv/` is written
//! instead of compared.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "interface/barriers.rs"]
mod barriers;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use lightpaths::gpu::hash::fnv1a;
use lightpaths::gpu::shaders::{SHADERS, Shader};
use lightpaths::gpu::spirv::{self, Module};
use lightpaths::layout::Layout;
use lightpaths::passes;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn manifest_line(shader: &Shader, binary: &[u8]) -> String {
    format!("{} {} {}\n", shader.stem, shader.source_hash, fnv1a(binary))
}

/// `spirv/MANIFEST` without its first line, which names the compiler.
fn manifest_entries() -> String {
    let manifest = fs::read_to_string(root().join("spirv/MANIFEST")).expect("spirv/MANIFEST is committed");
    manifest.split_once('\n').expect("the first line names the compiler").1.to_owned()
}

#[test]
fn manifest_matches_glsl() {
    if is_blessing() {
        return;
    }
    let entries: String = SHADERS
        .iter()
        .map(|shader| {
            let binary = fs::read(root().join(format!("spirv/{}.spv", shader.stem)));
            manifest_line(
                shader,
                &binary.unwrap_or_else(|error| panic!("spirv/{}.spv: {error}", shader.stem)),
            )
        })
        .collect();
    assert_eq!(entries, manifest_entries(), "sources or binaries changed: run `make spirv`");
}

#[test]
fn every_binary_has_a_source() {
    if is_blessing() {
        return;
    }
    let stems: BTreeSet<String> = SHADERS.iter().map(|shader| format!("{}.spv", shader.stem)).collect();
    let files = fs::read_dir(root().join("spirv")).expect("spirv/ is committed");
    let files: BTreeSet<String> = files
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "MANIFEST")
        .collect();
    assert_eq!(
        files.difference(&stems).collect::<Vec<_>>(),
        Vec::<&String>::new(),
        "in spirv/ without a source"
    );
}

/// Every Vulkan object has a name for debuggers: each file creates and names the same number.
#[test]
fn vulkan_objects_are_named() {
    // These have no name: they are created before the functions that set names.
    const NAMELESS: [&str; 4] = ["instance(", "device(", "debug_utils_messenger(", "surface("];
    let mut made = 0;
    let mut folders = vec![root().join("src/gpu")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            let creates = |line: &&str| {
                let call = line.split_once(".create_").map(|(_, call)| call);
                let is_unsafe = line.contains(concat!("un", "safe {"));
                is_unsafe && call.is_some_and(|call| !NAMELESS.iter().any(|name| call.starts_with(name)))
                    || line.contains(".allocate_command_buffers(")
            };
            let (objects, names) = (text.lines().filter(creates).count(), text.matches(".set_name(").count());
            assert!(names >= objects, "{}: {objects} objects, {names} names", path.display());
            made += objects;
        }
    }
    assert!(made >= 15, "the calls that make objects are found: {made}");
}

fn is_blessing() -> bool {
    let is_asked = std::env::var_os("LIGHTPATHS_BLESS").is_some();
    assert!(!is_asked || cfg!(feature = "shaderc"), "blessing needs the compiler: add --features shaderc");
    is_asked
}

#[cfg(feature = "shaderc")]
#[test]
fn spirv_matches_compiler() {
    if is_blessing() {
        return bless();
    }
    for shader in SHADERS {
        let committed = fs::read(root().join(format!("spirv/{}.spv", shader.stem))).unwrap();
        assert!(*shader.bytes == committed, "spirv/{}.spv is not what the compiler makes", shader.stem);
    }
    let manifest = fs::read_to_string(root().join("spirv/MANIFEST")).unwrap();
    assert_eq!(manifest.lines().next().unwrap(), compiler(), "the compiler changed: run `make spirv`");
}

#[cfg(feature = "shaderc")]
fn bless() {
    let spirv = root().join("spirv");
    let mut manifest = compiler() + "\n";
    let _ = fs::remove_dir_all(&spirv);
    fs::create_dir(&spirv).unwrap();
    for shader in SHADERS {
        fs::write(spirv.join(format!("{}.spv", shader.stem)), &shader.bytes).unwrap();
        manifest += &manifest_line(shader, &shader.bytes);
    }
    fs::write(spirv.join("MANIFEST"), manifest).unwrap();
}

/// The first line of the manifest. Only the locked version of the compiler gives the same bytes.
#[cfg(feature = "shaderc")]
fn compiler() -> String {
    let lock = fs::read_to_string(root().join("Cargo.lock")).unwrap();
    let (_, package) = lock.split_once("name = \"shaderc\"\nversion = \"").expect("shaderc is locked");
    format!("compiler shaderc {} vulkan1.2 level zero", package.split_once('"').unwrap().0)
}

fn modules() -> impl Iterator<Item = (&'static str, Module)> {
    SHADERS.iter().map(|shader| (shader.stem, spirv::reflect(&shader.words())))
}

#[test]
fn the_reader_sees_what_a_shader_declares() {
    let module = spirv::reflect(&Shader::named("prefix_sum").words());
    let binding = |binding, name: &str, access| spirv::Binding {
        set: 0,
        binding,
        name: name.into(),
        access,
        is_texels: false,
        element: Some("uint".into()),
        stride: Some(4),
    };
    let count = spirv::Member { name: "count".into(), offset: 0, size: 4, scalar: "uint".into() };
    let constant = |id, name: &str| spirv::Constant { id, name: name.into() };
    let expected = Module {
        // The host sets the number.
        local_size: [1, 1, 1],
        bindings: vec![
            binding(0, "Values", spirv::Access::ReadWrite),
            binding(1, "BlockOffsets", spirv::Access::Read),
        ],
        push: Some(spirv::Push { element: Some("PrefixSumPush".into()), size: 4 }),
        constants: vec![constant(0, "ITEMS"), constant(3, "local_size_x")],
        structures: vec![spirv::Structure { name: "PrefixSumPush".into(), members: vec![count] }],
        capabilities: vec![1],
        instruction_sets: vec!["GLSL.std.450".into()],
        has_workgroup_count: true,
    };
    assert_eq!(module, expected);
    assert_eq!(spirv::reflect(&Shader::named("edge_mark").words()).local_size, [64, 1, 1]);
    let module = spirv::reflect(&Shader::named("prefix_sum_reduce").words());
    assert_eq!(module.bindings[1].access, spirv::Access::Write);

    let given_by_the_host = |stem| {
        let constants = spirv::reflect(&Shader::named(stem).words()).constants.into_iter();
        constants.filter(|constant| spirv::LOCAL_SIZE.contains(&&*constant.name)).count()
    };
    assert_eq!((given_by_the_host("clearance"), given_by_the_host("edge_mark")), (1, 0));
}

#[test]
fn structures_agree_member_by_member() {
    let layouts = passes::layouts();
    let mut used = BTreeSet::new();
    for (stem, module) in modules() {
        for structure in &module.structures {
            let name = &structure.name;
            let layout = layouts.iter().find(|layout| layout.name == name);
            let layout =
                layout.unwrap_or_else(|| panic!("`{stem}`: `{name}` has no reference in passes::layouts()"));
            assert_eq!(shader_members(structure), host_members(layout), "`{stem}`: members of `{name}`");
            used.insert(layout.name);
        }
    }
    let registered: BTreeSet<_> = layouts.iter().map(|layout| layout.name).collect();
    assert_eq!(registered.len(), layouts.len(), "a structure is registered once");
    // Kernels read this one as texels alone: structures_match_their_source compares it.
    used.insert("LightSource");
    assert_eq!(registered, used, "registered structures are used by a shader");
}

/// Structures that shaders load from texels have no layout in SPIR-V. Their members follow
/// each other in both sources.
#[test]
fn structures_match_their_source() {
    let source = read(&root().join("glsl/include/types.glsl"));
    for layout in lightpaths::types::LAYOUTS {
        let head = format!("struct {} {{\n", layout.name);
        let (_, body) = source.split_once(&head).unwrap_or_else(|| panic!("no `{head}`"));
        let (body, _) = body.split_once("};").unwrap();
        let mut offset = 0;
        let members = body.lines().filter_map(|line| {
            let (declaration, _) = line.split_once(';')?;
            let (kind, name) = declaration.trim().split_once(' ')?;
            let (scalar, count) = match kind {
                "mat3" => ("float", 9),
                _ => match kind.strip_prefix("uvec").or(kind.strip_prefix("vec")) {
                    Some(count) if kind.starts_with('u') => ("uint", count.parse().unwrap()),
                    Some(count) => ("float", count.parse().unwrap()),
                    None => (kind, 1),
                },
            };
            offset += 4 * count;
            Some((name.trim().to_owned(), offset - 4 * count, 4 * count, scalar.to_owned()))
        });
        assert_eq!(members.collect::<Members>(), host_members(layout), "members of `{}`", layout.name);
    }
}

type Members = Vec<(String, usize, usize, String)>;

fn shader_members(structure: &spirv::Structure) -> Members {
    let members = structure.members.iter();
    members.map(|m| (m.name.clone(), m.offset as usize, m.size as usize, m.scalar.clone())).collect()
}

fn host_members(layout: &Layout) -> Members {
    let members = layout.members.iter();
    members.map(|m| (m.name.into(), m.offset, m.size, scalar(m.rust_type))).collect()
}

/// The GLSL scalar type of a Rust type as written: `[glam::UVec2; 4]` consists of `uint`.
fn scalar(rust_type: &str) -> String {
    let element = rust_type.trim_start_matches('[').split(';').next().unwrap().trim();
    match element.rsplit("::").next().unwrap() {
        "u32" | "UVec2" | "UVec3" | "UVec4" => "uint",
        "i32" | "IVec2" | "IVec3" | "IVec4" => "int",
        "f32" | "Vec2" | "Vec3" | "Mat3" | "Vec4" | "Mat4" => "float",
        name => name,
    }
    .into()
}

/// Constants that shaders and the host both define.
#[test]
fn constants_have_one_value() {
    use lightpaths::passes::frame::shafts::{BATCH, SHAFT_WORDS};
    use lightpaths::types::{Node, Surface, Triangle};
    let shafts = read(&root().join("glsl/include/shafts.glsl"));
    for (name, value) in [("BATCH", BATCH), ("SHAFT_WORDS", SHAFT_WORDS), ("MAX_ROOTS", SHAFT_WORDS - 1)] {
        let line = format!("const uint {name} = {value}u;");
        assert!(shafts.contains(&line), "no `{line}` in shafts.glsl");
    }
    let textures = read(&root().join("glsl/include/textures.glsl"));
    let line = format!("const uint CLAMPED_TO_TRIANGLE = {}u;", lightpaths::types::CLAMPED_TO_TRIANGLE);
    assert!(textures.contains(&line), "no `{line}` in textures.glsl");
    let lists = read(&root().join("glsl/include/lists.glsl"));
    let texels = [
        ("NODE_TEXELS", size_of::<Node>()),
        ("TRIANGLE_TEXELS", size_of::<Triangle>()),
        ("SURFACE_TEXELS", size_of::<Surface>()),
    ];
    for (name, bytes) in texels {
        let line = format!("const uint {name} = {}u;", bytes / 16);
        assert!(bytes % 16 == 0 && lists.contains(&line), "no `{line}` in lists.glsl");
    }
}

#[test]
fn blocks_wrap_one_array_or_structure() {
    let layouts = passes::layouts();
    let size =
        |name: &str| layouts.iter().find(|layout| layout.name == name).map(|layout| layout.size as u32);
    for (stem, module) in modules() {
        for (number, binding) in module.bindings.iter().enumerate() {
            let name = &binding.name;
            assert!(!name.is_empty(), "`{stem}`: names are kept");
            assert_eq!(
                (binding.set, binding.binding),
                (0, number as u32),
                "`{stem}`: `{name}` is numbered in order"
            );
            if binding.is_texels {
                continue;
            }
            let element =
                binding.element.as_deref().unwrap_or_else(|| panic!("`{stem}`: `{name}` has one member"));
            // The stride of an array of a shared structure is the structure's size, as in Rust.
            if let (Some(stride), Some(size)) = (binding.stride, size(element)) {
                assert_eq!(stride, size, "`{stem}`: `{name}` steps from one `{element}` to the next");
            }
        }
        let names: BTreeSet<_> = module.bindings.iter().map(|binding| &binding.name).collect();
        assert_eq!(names.len(), module.bindings.len(), "`{stem}`: block names are told apart");
        if let Some(push) = module.push {
            let element = push.element.unwrap_or_else(|| panic!("`{stem}`: the push block has one member"));
            assert_eq!(Some(push.size), size(&element), "`{stem}`: the push block is a registered structure");
        }
    }
}

#[test]
fn shaders_keep_to_the_rules() {
    const SHADER: u32 = 1;
    const TEXELS: u32 = 46;
    const ADDRESSES: u32 = 5347;
    for (stem, module) in modules() {
        let follows =
            module.constants.iter().any(|constant| constant.name == spirv::USE_BUFFER_DEVICE_ADDRESS);
        // Texel buffers are no feature: every device has them.
        let reads_texels = module.bindings.iter().any(|binding| binding.is_texels);
        let needs = [(SHADER, true), (TEXELS, reads_texels), (ADDRESSES, follows)];
        let allowed: Vec<u32> = needs.into_iter().filter(|need| need.1).map(|need| need.0).collect();
        assert_eq!(module.capabilities, allowed, "`{stem}` asks for no other feature");
        assert_eq!(module.instruction_sets, ["GLSL.std.450"], "`{stem}` does not print");
        for constant in &module.constants {
            assert!(!constant.name.is_empty(), "`{stem}`: names are kept");
        }
    }
}

/// A ray may meet more than a device's loops traverse: see `glsl/include/quirks.glsl`. The
/// search for roots of shafts visits few nodes, and batches trace no rays.
#[test]
fn kernels_that_follow_rays_ask_whether_their_loops_completed() {
    let mut followers = 0;
    for shader in SHADERS {
        let source = read(&root().join(format!("glsl/{}.comp", shader.stem)));
        let includes = |name: &str| source.contains(&format!("#include \"include/{name}.glsl\""));
        if includes("bvh") && !includes("open_tree") && !shader.stem.ends_with("_batches") {
            assert!(source.contains("loops_completed("), "`{}` does not ask", shader.stem);
            followers += 1;
        }
    }
    assert!(followers > 15, "{followers} kernels follow rays");
}

/// The window traces light paths again if one of these shaders is reloaded.
#[test]
fn shaders_of_the_precomputation_are_listed() {
    let files = rust_files(&root().join("src/passes/precompute"));
    let made: usize = files.iter().map(|path| read(path).matches("Pipeline::new(").count()).sum();
    assert_eq!(made, passes::precompute::STEMS.len());
    assert!(passes::precompute::STEMS.iter().all(|stem| SHADERS.iter().any(|shader| shader.stem == *stem)));
}

/// Every name in a shader's interface is used by the host file of its pass, or by `Tuning`.
#[test]
fn host_files_name_what_shaders_declare() {
    let mut host: String = rust_files(&root().join("src/passes")).iter().map(|path| read(path)).collect();
    host += &read(&root().join("src/gpu/tuning.rs"));
    for (stem, module) in modules() {
        let bindings = module.bindings.iter().map(|binding| &binding.name);
        let constants = module.constants.iter().map(|constant| &constant.name);
        // `Pipeline` sets the constants that follow from the bindings.
        let elsewhere =
            |name: &str| spirv::LOCAL_SIZE.contains(&name) || spirv::FROM_BINDINGS.contains(&name);
        let constants = constants.filter(|name| !elsewhere(name));
        for name in bindings.chain(constants) {
            assert!(host.contains(&format!("\"{name}\"")), "`{stem}`: no pass names `{name}`");
        }
        assert!(host.contains(&format!("\"{stem}\"")), "no pass uses `{stem}`");
    }
}

/// Modules of the library in module layers. Each imports from the module layers above its own in
/// this list, and from its own. The reference implementation does not use the device.
const LAYERS: [&[&str]; 6] = [
    &["error", "files", "layout", "types"],
    &["gpu", "scene"],
    &["cpu", "image", "metrics", "cache_file"],
    &["passes"],
    &["reference", "renderer"],
    &["app"],
];

#[test]
fn layers_import_in_one_direction() {
    let layer = |module: &str| LAYERS.iter().position(|layer| layer.contains(&module));
    let src = root().join("src");
    for path in rust_files(&src) {
        let relative = path.strip_prefix(&src).unwrap();
        let first = relative.components().next().unwrap().as_os_str().to_str().unwrap();
        let module = first.trim_end_matches(".rs");
        let Some(own) = layer(module) else {
            assert!(["lib", "main"].contains(&module), "src/{first} is in no layer");
            continue;
        };
        for line in read(&path).lines() {
            let Some((_, import)) = line.trim().split_once("use crate::") else { continue };
            let paths: Vec<_> = match import.strip_prefix('{') {
                Some(list) => list.trim_end_matches(['}', ';']).split(", ").collect(),
                None => vec![import],
            };
            for path in paths {
                let imported = match path.split([':', ';', ' ']).next().unwrap() {
                    "Error" | "Result" => "error",
                    name => name,
                };
                let other = layer(imported);
                let other = other
                    .unwrap_or_else(|| panic!("{relative:?}: `{line}` starts with no module in a layer"));
                let is_below = other < own || imported == module || (other == 0 && own == 0);
                let sees_no_device = module != "cpu" || imported != "gpu";
                assert!(is_below && sees_no_device, "{relative:?}: {module} must not import {imported}");
            }
        }
    }
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Unsafe code is allowed in the device module, and in tests that cannot do without it.
#[test]
fn unsafe_code_is_where_it_may_be() {
    const MAY: [&str; 3] = ["src/gpu/", "tests/faults/", "tests/readers/memory.rs"];
    let mut found = BTreeSet::new();
    for folder in ["src", "crates", "tests", "examples", "python/src", "fuzz/src", "fuzz/fuzz_targets"] {
        for path in rust_files(&root().join(folder)) {
            let code = read(&path);
            let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            let is_code = |line: &str| {
                line.split(|c: char| !c.is_alphanumeric() && c != '_')
                    .any(|word| word == concat!("un", "safe"))
            };
            if code.into_iter().any(is_code) {
                let name = path.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/");
                let place = MAY.iter().find(|place| name.starts_with(**place));
                found.insert(*place.unwrap_or_else(|| panic!("{name} has {} code", concat!("un", "safe"))));
            }
        }
    }
    assert_eq!(found.len(), MAY.len(), "all places are found");
    // The compiler forbids it in every module of the library but one.
    let library = read(&root().join("src/lib.rs"));
    let modules: Vec<&str> =
        library.lines().filter(|line| line.starts_with("pub mod") || line.starts_with("mod ")).collect();
    let forbidden = library.matches(concat!("#[forbid(un", "safe_code)]\n")).count();
    assert_eq!(forbidden + 1, modules.len());
    assert!(
        library.contains("\npub mod gpu;")
            && !library.contains(concat!("#[forbid(un", "safe_code)]\npub mod gpu;"))
    );
}

/// Names that `src/lib.rs` exports, except modules.
fn exported(library: &str) -> Vec<String> {
    let code: String = library.lines().filter(|line| !line.starts_with("//")).collect();
    let uses = code.split(';').filter_map(|item| item.split_once("pub use ").map(|(_, path)| path.trim()));
    let names = |path: &str| match path.split_once('{') {
        Some((_, list)) => list.trim_end_matches('}').split(',').map(|name| name.trim().to_owned()).collect(),
        None => vec![path.rsplit("::").next().unwrap().to_owned()],
    };
    uses.flat_map(names).filter(|name| !name.is_empty()).collect()
}

#[test]
fn the_library_has_at_most_thirty_public_items() {
    const MOST: usize = 30;
    let library = read(&root().join("src/lib.rs"));
    let names = exported(&library);
    assert!(names.iter().all(|name| name != "*"), "a glob exports any number of items");
    assert!(names.contains(&"Renderer".to_owned()) && names.contains(&"glam".to_owned()), "{names:?}");
    assert!(names.len() <= MOST, "{} items, {MOST} at most: {names:?}", names.len());
    // All other public items are hidden modules.
    let lines: Vec<&str> = library.lines().collect();
    for (number, line) in lines.iter().enumerate().filter(|(_, line)| line.starts_with("pub ")) {
        let attributes = lines[..number].iter().rev().take_while(|line| line.starts_with("#["));
        let is_hidden = attributes.into_iter().any(|line| *line == "#[doc(hidden)]");
        let is_module = line.starts_with("pub mod ");
        assert!(
            line.starts_with("pub use ") || (is_module && is_hidden),
            "{line}: neither hidden nor exported"
        );
    }
}

/// The example shows the public interface, so it uses nothing else.
#[test]
fn the_example_uses_public_items_only() {
    let names = exported(&read(&root().join("src/lib.rs")));
    let example = read(&root().join("examples/relight.rs"));
    let used: Vec<&str> = example.split("lightpaths::").skip(1).collect();
    assert!(!used.is_empty());
    for path in used {
        let list = path.strip_prefix('{').map_or(path, |list| list.split('}').next().unwrap());
        let parts = list.split(if path.starts_with('{') { ',' } else { ':' }).map(str::trim);
        for name in parts.filter(|name| !name.is_empty()) {
            let first: String = name.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            assert!(names.contains(&first), "examples/relight.rs uses `{first}`");
            if !path.starts_with('{') {
                break;
            }
        }
    }
}
