//! Shared memory of a shader's workgroups, from its SPIR-V.

use std::collections::HashMap;

/// Opcodes and a storage class of the SPIR-V specification.
const TYPE_BOOL: u32 = 20;
const TYPE_INT: u32 = 21;
const TYPE_FLOAT: u32 = 22;
const TYPE_VECTOR: u32 = 23;
const TYPE_ARRAY: u32 = 28;
const TYPE_STRUCT: u32 = 30;
const TYPE_POINTER: u32 = 32;
const CONSTANT: u32 = 43;
const SPEC_CONSTANT: u32 = 50;
const SPEC_CONSTANT_COMPOSITE: u32 = 51;
const SPEC_CONSTANT_OP: u32 = 52;
const VARIABLE: u32 = 59;
const COMPOSITE_EXTRACT: u32 = 81;
const MULTIPLY: u32 = 132;
const WORKGROUP: u32 = 4;

/// Maximum number of invocations of a workgroup whose size the device sets
/// (`Tuning::waiting_group`). The shaders declare 0.
const WAITING: u32 = 64;

/// Bytes of all shared variables of a module.
pub fn shared_bytes(words: &[u32]) -> u32 {
    let (mut sizes, mut pointees, mut values) = (HashMap::new(), HashMap::new(), HashMap::new());
    let (mut composites, mut shared) = (HashMap::new(), 0);
    let mut rest = &words[5..];
    while let [first, ..] = rest {
        let (instruction, later) = rest.split_at((first >> 16) as usize);
        rest = later;
        let size = |of: u32| sizes.get(&of).copied().unwrap_or(0);
        match (first & 0xffff, &instruction[1..]) {
            (TYPE_BOOL, &[id]) => _ = sizes.insert(id, 4),
            (TYPE_INT, &[id, bits, _]) | (TYPE_FLOAT, &[id, bits]) => _ = sizes.insert(id, bits / 8),
            (TYPE_VECTOR, &[id, of, count]) => _ = sizes.insert(id, size(of) * count),
            (TYPE_ARRAY, &[id, of, count]) => _ = sizes.insert(id, size(of) * values[&count]),
            (TYPE_STRUCT, [id, members @ ..]) => {
                sizes.insert(*id, members.iter().map(|&member| size(member)).sum());
            }
            (TYPE_POINTER, &[id, WORKGROUP, of]) => _ = pointees.insert(id, of),
            (CONSTANT, &[_, id, value, ..]) => _ = values.insert(id, value),
            (SPEC_CONSTANT, &[_, id, value, ..]) => {
                values.insert(id, if value == 0 { WAITING } else { value });
            }
            (SPEC_CONSTANT_COMPOSITE, [_, id, parts @ ..]) => _ = composites.insert(*id, parts.to_vec()),
            (SPEC_CONSTANT_OP, &[_, id, COMPOSITE_EXTRACT, of, index]) => {
                values.insert(id, values[&composites[&of][index as usize]]);
            }
            (SPEC_CONSTANT_OP, &[_, id, MULTIPLY, a, b]) => _ = values.insert(id, values[&a] * values[&b]),
            (VARIABLE, &[kind, _, WORKGROUP, ..]) => shared += size(pointees[&kind]),
            _ => {}
        }
    }
    shared
}
