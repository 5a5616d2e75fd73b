//! Shaders without dead branches: those of the program, and modules by hand.

use super::dead_branches::remove;
use super::{code, instructions, reflect, string};
use crate::gpu::shaders::{SHADERS, Shader};
use std::collections::HashSet;

/// Values of a shader's constants: one for all but one, which has another.
fn choices(shader: &Shader) -> Vec<Vec<(u32, u32)>> {
    let constants = reflect(&shader.words()).constants;
    let of = |changed: usize, others: u32, value: u32| {
        let numbered = constants.iter().enumerate();
        numbered
            .map(|(index, constant)| (constant.id, if index == changed { value } else { others }))
            .collect()
    };
    let changed = 0..=constants.len();
    changed.flat_map(|changed| [of(changed, 0, 1), of(changed, 1, 0), of(changed, 1, 2)]).collect()
}

fn names(words: &[u32]) -> Vec<String> {
    let names = instructions(words).filter(|instruction| instruction.opcode() == code::NAME);
    names.map(|name| string(&name.operands()[1..])).collect()
}

#[test]
fn what_stays_of_a_shader_is_whole() {
    for shader in SHADERS {
        let (words, module) = (shader.words(), reflect(&shader.words()));
        for values in choices(shader) {
            let short = remove(&words, &values);
            assert!(short.len() <= words.len(), "{}", shader.stem);
            assert_eq!(reflect(&short), module, "{}", shader.stem);
            let defined: HashSet<u32> = instructions(&short).filter_map(|found| found.result()).collect();
            for instruction in instructions(&short) {
                let used = match (instruction.opcode(), instruction.operands()) {
                    (code::BRANCH, operands) => operands,
                    (code::SELECTION_MERGE, operands) => &operands[..1],
                    (code::BRANCH_CONDITIONAL, operands) => &operands[1..3],
                    (code::LOOP_MERGE, operands) => &operands[..2],
                    (code::FUNCTION_CALL | code::PHI, operands) => &operands[2..],
                    _ => &[],
                };
                assert_eq!(used.iter().find(|id| !defined.contains(id)), None, "{}, {values:?}", shader.stem);
            }
        }
    }
}

#[test]
fn functions_that_are_switched_off_are_gone() {
    let words = Shader::named("direct").words();
    let finds_alike = reflect(&words).constants.into_iter().find(|constant| constant.name == "FINDS_ALIKE");
    let id = finds_alike.unwrap().id;
    for (value, is_there) in [(0, false), (1, true)] {
        let short = remove(&words, &[(id, value)]);
        let found = names(&short).iter().any(|name| name.starts_with("light_factor_in_group("));
        assert_eq!(found, is_there);
    }
    assert!(remove(&words, &[(id, 0)]).len() < words.len() * 9 / 10);
}

/// A module of one function without parameters, whose constants have the ids 1 to 4: `true`,
/// `false`, 7 and 8; 5 is specialisation constant 0, a boolean.
fn module(body: &[&[u32]]) -> Vec<u32> {
    let (function, types) = (20, 30);
    let declarations: [&[u32]; 8] = [
        &[code::ENTRY_POINT.into(), 5, function, 0],
        &[code::DECORATE.into(), 5, code::SPEC_ID, 0],
        &[code::CONSTANT_TRUE.into(), types, 1],
        &[code::CONSTANT_FALSE.into(), types, 2],
        &[code::CONSTANT.into(), types, 3, 7],
        &[code::CONSTANT.into(), types, 4, 8],
        &[code::SPEC_CONSTANT_FALSE.into(), types, 5],
        &[code::FUNCTION.into(), types, function, 0, types],
    ];
    let end = [u32::from(code::FUNCTION_END)];
    let all = declarations.into_iter().chain(body.iter().copied()).chain([&end[..]]);
    let encoded = all.flat_map(|words| {
        std::iter::once((words.len() as u32) << 16 | words[0]).chain(words[1..].iter().copied())
    });
    [code::MAGIC, 0, 0, 0, 0].into_iter().chain(encoded.collect::<Vec<_>>()).collect()
}

/// Opcodes and operands of the function's body.
fn body(words: &[u32]) -> Vec<Vec<u32>> {
    let all = instructions(words).skip_while(|found| found.opcode() != code::FUNCTION);
    let inner = all.filter(|found| !matches!(found.opcode(), code::FUNCTION | code::FUNCTION_END));
    inner
        .map(|found| std::iter::once(found.opcode().into()).chain(found.operands().to_vec()).collect())
        .collect()
}

#[test]
fn a_decided_selection_leaves_one_way_and_decides_what_follows() {
    let [label, branch, select] = [code::LABEL, code::BRANCH, code::BRANCH_CONDITIONAL].map(u32::from);
    let [merge, phi, equal] = [code::SELECTION_MERGE, code::PHI, code::I_EQUAL].map(u32::from);
    let leave = u32::from(code::UNREACHABLE);
    let words = module(&[
        &[label, 40],
        &[merge, 43, 0],
        &[select, 5, 41, 42],
        &[label, 41],
        &[branch, 43],
        &[label, 42],
        &[branch, 43],
        &[label, 43],
        &[phi, 30, 50, 3, 41, 4, 42],
        &[equal, 30, 51, 50, 3],
        &[merge, 46, 0],
        &[select, 51, 44, 45],
        &[label, 44],
        &[branch, 46],
        &[label, 45],
        &[branch, 46],
        &[label, 46],
        &[leave],
    ]);
    let wanted = |first: u32, value: u32, second: u32| -> Vec<Vec<u32>> {
        vec![
            vec![label, 40],
            vec![branch, first],
            vec![label, first],
            vec![branch, 43],
            vec![label, 43],
            vec![phi, 30, 50, value, first],
            vec![equal, 30, 51, 50, 3],
            vec![branch, second],
            vec![label, second],
            vec![branch, 46],
            vec![label, 46],
            vec![leave],
        ]
    };
    assert_eq!(body(&remove(&words, &[(0, 1)])), wanted(41, 3, 44));
    assert_eq!(body(&remove(&words, &[(0, 0)])), wanted(42, 4, 45));
    // The default is false.
    assert_eq!(body(&remove(&words, &[])), wanted(42, 4, 45));
}

#[test]
fn a_loop_that_never_runs_again_keeps_the_blocks_that_its_header_names() {
    let [label, branch, select] = [code::LABEL, code::BRANCH, code::BRANCH_CONDITIONAL].map(u32::from);
    let [repeat, leave] = [code::LOOP_MERGE, code::UNREACHABLE].map(u32::from);
    let words = module(&[
        &[label, 40],
        &[branch, 41],
        &[label, 41],
        &[repeat, 45, 44, 0],
        &[branch, 42],
        &[label, 42],
        &[select, 5, 43, 45],
        &[label, 43],
        &[branch, 44],
        &[label, 44],
        &[branch, 41],
        &[label, 45],
        &[leave],
    ]);
    let words_of_body = body(&words).len();
    let short = body(&remove(&words, &[(0, 0)]));
    let wanted: [&[u32]; 11] = [
        &[label, 40],
        &[branch, 41],
        &[label, 41],
        &[repeat, 45, 44, 0],
        &[branch, 42],
        &[label, 42],
        &[branch, 45],
        &[label, 44],
        &[branch, 41],
        &[label, 45],
        &[leave],
    ];
    assert_eq!(short, wanted);
    // If it runs for ever, the block after it stays as one that nothing reaches.
    let endless = body(&remove(&words, &[(0, 1)]));
    assert_eq!(endless[6..8], [vec![branch, 43], vec![label, 43]]);
    assert_eq!(endless.len(), words_of_body);
}
