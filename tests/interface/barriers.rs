//! Shared memory of workgroups: an invocation reads or overwrites another's value only after a
//! barrier. Lavapipe runs the invocations of a subgroup in lockstep, so no picture shows a
//! missing `barrier()` there.
//!
//! The check follows the control flow of the SPIR-V and keeps the accesses since the last barrier.
//! Two accesses conflict if one of them writes. There are four exceptions: both are atomic; both
//! are of the invocation's own element; one invocation makes both; or one is of the lower and one
//! of the upper half in a reduction.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use lightpaths::gpu::shaders::SHADERS;

/// Opcodes and enumerants [SPIR-V §3].
mod op {
    pub(super) const NAME: u16 = 5;
    pub(super) const CONSTANT: u16 = 43;
    pub(super) const FUNCTION: u16 = 54;
    pub(super) const FUNCTION_END: u16 = 56;
    pub(super) const CALL: u16 = 57;
    pub(super) const VARIABLE: u16 = 59;
    pub(super) const LOAD: u16 = 61;
    pub(super) const STORE: u16 = 62;
    pub(super) const ACCESS_CHAINS: std::ops::RangeInclusive<u16> = 65..=66;
    pub(super) const DECORATE: u16 = 71;
    pub(super) const ADD: u16 = 128;
    pub(super) const MULTIPLY: u16 = 132;
    pub(super) const EQUAL: u16 = 170;
    pub(super) const NOT_EQUAL: u16 = 171;
    pub(super) const GREATER: u16 = 172;
    pub(super) const LESS: u16 = 176;
    pub(super) const CONTROL_BARRIER: u16 = 224;
    pub(super) const PHI: u16 = 245;
    pub(super) const ATOMIC_STORE: u16 = 228;
    pub(super) const ATOMICS: std::ops::RangeInclusive<u16> = 227..=242;
    pub(super) const LABEL: u16 = 248;
    pub(super) const BRANCH: u16 = 249;
    pub(super) const BRANCH_CONDITIONAL: u16 = 250;
    pub(super) const SWITCH: u16 = 251;
    pub(super) const RETURN: u16 = 253;
    pub(super) const ENDS: std::ops::RangeInclusive<u16> = 252..=255;
    pub(super) const WORKGROUP: u32 = 4;
    pub(super) const BUILT_IN: u32 = 11;
    pub(super) const LOCAL_ID: u32 = 27;
    pub(super) const LOCAL_INDEX: u32 = 29;
}

#[derive(Clone)]
struct Instruction {
    code: u16,
    operands: Vec<u32>,
}

/// The form of an index. Texts name variables of a function as `%7;`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Index {
    /// The whole variable.
    Whole,
    Constant(u32),
    /// `gl_LocalInvocationIndex` or a component of `gl_LocalInvocationID`.
    Own,
    /// A loop variable that starts at the invocation's own number; the step, which is the
    /// workgroup's size in all shaders.
    Strided(String),
    /// A sum with the invocation's own number, or a product of it: it differs from one invocation
    /// to the next.
    OwnWith(String),
    Other(String),
}

/// Constraints on the invocations that reach a block.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Guard {
    /// The number of the only invocation.
    only: Option<u32>,
    /// Upper bound of their numbers, exclusive.
    below: Option<Index>,
}

impl Guard {
    /// The constraints where both branches meet.
    fn and(&self, other: &Self) -> Self {
        Self {
            only: self.only.filter(|_| self.only == other.only),
            below: self.below.clone().filter(|_| self.below == other.below),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Read,
    Write,
    Atomic,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Access {
    variable: u32,
    kind: Kind,
    index: Index,
    guard: Guard,
}

impl Access {
    fn is_in_conflict_with(&self, other: &Self) -> bool {
        let one_writes = self.kind != Kind::Read || other.kind != Kind::Read;
        let both_atomic = self.kind == Kind::Atomic && other.kind == Kind::Atomic;
        let apart = match (&self.index, &other.index) {
            (Index::Constant(a), Index::Constant(b)) => a != b,
            (Index::Own, Index::Own) => true,
            (Index::OwnWith(a), Index::OwnWith(b)) | (Index::Strided(a), Index::Strided(b)) => a == b,
            (Index::Own, Index::OwnWith(sum)) | (Index::OwnWith(sum), Index::Own) => {
                self.is_half(sum) && other.is_half(sum)
            }
            _ => false,
        };
        let by_one = self.guard.only.is_some() && self.guard.only == other.guard.only;
        self.variable == other.variable && one_writes && !both_atomic && !apart && !by_one
    }

    /// Whether the numbers of these invocations are below the value that is added to them in `sum`.
    fn is_half(&self, sum: &str) -> bool {
        self.guard.below.as_ref().is_some_and(|below| sum == sum_text(&[Index::Own, below.clone()]))
    }

    /// Removes texts with this variable: it has another value.
    fn forget(&mut self, variable: u32) {
        let name = format!("%{variable};");
        let is_of = |index: &Index| match index {
            Index::OwnWith(text) | Index::Other(text) => text.contains(&name),
            _ => false,
        };
        if is_of(&self.index) {
            self.index = Index::Other(String::new());
        }
        if self.guard.below.as_ref().is_some_and(is_of) {
            self.guard.below = None;
        }
    }
}

fn sum_text(sides: &[Index; 2]) -> String {
    format!("{sides:?}")
}

/// Accesses since the last barrier, on any path to a point.
type Pending = BTreeSet<Access>;

/// Variables with two conflicting accesses.
type Conflicts = BTreeSet<(String, String)>;

struct Block {
    label: u32,
    instructions: Vec<Instruction>,
    next: Vec<u32>,
}

#[derive(Default)]
struct Program {
    names: HashMap<u32, String>,
    /// Instructions with a result, by result id.
    defined: HashMap<u32, Instruction>,
    /// The values that are stored to a variable.
    stored: HashMap<u32, Vec<u32>>,
    local: BTreeSet<u32>,
    shared: BTreeSet<u32>,
    /// Blocks in the order of the module, by the function's id.
    functions: BTreeMap<u32, Vec<Block>>,
    entry: u32,
}

impl Program {
    fn read(words: &[u32]) -> Self {
        let mut program = Self::default();
        let (mut rest, mut function) = (&words[5..], 0);
        while let Some(&first) = rest.first() {
            let (code, length) = (first as u16, (first >> 16) as usize);
            let instruction = Instruction { code, operands: rest[1..length].to_vec() };
            rest = &rest[length..];
            let operands = &instruction.operands;
            match code {
                op::NAME => {
                    let bytes: Vec<u8> = operands[1..].iter().flat_map(|word| word.to_le_bytes()).collect();
                    let name = String::from_utf8_lossy(&bytes);
                    program.names.insert(operands[0], name.trim_end_matches('\0').to_owned());
                }
                op::DECORATE
                    if operands[1] == op::BUILT_IN
                        && [op::LOCAL_ID, op::LOCAL_INDEX].contains(&operands[2]) =>
                {
                    program.local.insert(operands[0]);
                }
                op::VARIABLE if operands[2] == op::WORKGROUP => {
                    program.shared.insert(operands[1]);
                }
                op::STORE => program.stored.entry(operands[0]).or_default().push(operands[1]),
                op::FUNCTION => {
                    function = operands[1];
                    program.functions.insert(function, Vec::new());
                    if program.names.get(&function).is_some_and(|name| name == "main") {
                        program.entry = function;
                    }
                }
                op::LABEL => {
                    let block = Block { label: operands[0], instructions: Vec::new(), next: Vec::new() };
                    program.functions.get_mut(&function).unwrap().push(block);
                    continue;
                }
                op::FUNCTION_END => function = 0,
                _ => {}
            }
            // These instructions have type and result first.
            if matches!(code, op::CONSTANT | op::VARIABLE | op::LOAD | 65 | 66 | 124..=210 | op::PHI) {
                program.defined.insert(operands[1], instruction.clone());
            }
            if let Some(block) = program.functions.get_mut(&function).and_then(|blocks| blocks.last_mut()) {
                match code {
                    op::BRANCH => block.next.push(operands[0]),
                    op::BRANCH_CONDITIONAL => block.next.extend(&operands[1..3]),
                    op::SWITCH => {
                        block.next.push(operands[1]);
                        block.next.extend(operands[2..].chunks_exact(2).map(|case| case[1]));
                    }
                    _ => {}
                }
                block.instructions.push(instruction);
            }
        }
        program
    }

    /// A pointer's variable, and the indices from it to the pointer.
    fn place(&self, pointer: u32) -> (u32, &[u32]) {
        match self.defined.get(&pointer) {
            Some(chain) if op::ACCESS_CHAINS.contains(&chain.code) => {
                (chain.operands[2], &chain.operands[3..])
            }
            _ => (pointer, &[]),
        }
    }

    fn index(&self, value: u32) -> Index {
        self.index_within(value, 16)
    }

    /// A loop counter depends on itself: after `depth` steps the rest is a name.
    fn index_within(&self, value: u32, depth: u32) -> Index {
        let Some(Instruction { code, operands }) = self.defined.get(&value).filter(|_| depth > 0) else {
            return Index::Other(format!("value {value}"));
        };
        let of = |value: u32| self.index_within(value, depth - 1);
        match *code {
            op::CONSTANT => Index::Constant(operands[2]),
            op::LOAD => {
                let (variable, path) = self.place(operands[2]);
                if self.local.contains(&variable) {
                    return Index::Own;
                }
                let other = || Index::Other(format!("%{variable};{path:?}"));
                match *self.stored.get(&variable).map_or(&[][..], Vec::as_slice) {
                    [value] if path.is_empty() => of(value),
                    [first, next] if path.is_empty() && of(first) == Index::Own => {
                        self.step(variable, next).map_or_else(other, Index::Strided)
                    }
                    _ => other(),
                }
            }
            op::ADD | op::MULTIPLY => {
                let mut sides = [of(operands[2]), of(operands[3])];
                sides.sort();
                let is_own = |side: &Index| matches!(side, Index::Own | Index::OwnWith(_));
                let text = if *code == op::ADD { sum_text(&sides) } else { format!("product {sides:?}") };
                let owns = sides.iter().filter(|side| is_own(side)).count();
                if owns == 1 { Index::OwnWith(text) } else { Index::Other(text) }
            }
            _ => Index::Other(format!(
                "{code} {:?}",
                operands[2..].iter().map(|&value| of(value)).collect::<Vec<_>>()
            )),
        }
    }

    /// The step of a variable: `next` is the sum of the variable and a constant value.
    fn step(&self, variable: u32, next: u32) -> Option<String> {
        let sum = self.defined.get(&next).filter(|sum| sum.code == op::ADD)?;
        let loaded = self.defined.get(&sum.operands[2]).filter(|load| load.code == op::LOAD)?;
        let step = format!("{:?}", self.index(sum.operands[3]));
        (loaded.operands[2] == variable && !step.contains('%')).then_some(step)
    }

    /// The shared memory access of an instruction.
    fn access(&self, instruction: &Instruction, guard: &Guard) -> Option<Access> {
        let operands = &instruction.operands;
        let (pointer, kind) = match instruction.code {
            op::LOAD => (operands[2], Kind::Read),
            op::STORE => (operands[0], Kind::Write),
            op::ATOMIC_STORE => (operands[0], Kind::Atomic),
            code if op::ATOMICS.contains(&code) => (operands[2], Kind::Atomic),
            _ => return None,
        };
        let (variable, path) = self.place(pointer);
        let index = match path.first().map_or(Index::Whole, |&index| self.index(index)) {
            Index::Constant(number) if guard.only == Some(number) => Index::Own,
            index => index,
        };
        self.shared.contains(&variable).then(|| Access { variable, kind, index, guard: guard.clone() })
    }

    /// The constraints if a condition is true, or false.
    fn guard_of(&self, condition: u32, is_true: bool, known: &Guard, guards: &HashMap<u32, Guard>) -> Guard {
        let Some(Instruction { code, operands }) = self.defined.get(&condition) else { return known.clone() };
        match *code {
            op::EQUAL | op::NOT_EQUAL if (*code == op::EQUAL) == is_true => {
                match [operands[2], operands[3]].map(|side| self.index(side)) {
                    [Index::Own, Index::Constant(number)] => Guard { only: Some(number), ..known.clone() },
                    _ => known.clone(),
                }
            }
            op::LESS if is_true => match [operands[2], operands[3]].map(|side| self.index(side)) {
                [Index::Own, below] => Guard { below: Some(below), ..known.clone() },
                _ => known.clone(),
            },
            // `a && b`: true only through the block of `b`.
            op::PHI if is_true && operands.len() == 6 => {
                let way = guards.get(&operands[5]).unwrap_or(known);
                self.guard_of(operands[4], true, way, guards)
            }
            _ => known.clone(),
        }
    }

    /// Follows a function, given the accesses before it. Returns the accesses after it,
    /// and adds conflicts.
    fn follow(&self, function: u32, before: Pending, guard: &Guard, found: &mut Conflicts) -> Pending {
        let blocks = &self.functions[&function];
        let mut entering: HashMap<u32, Pending> = HashMap::from([(blocks[0].label, before)]);
        let mut guards: HashMap<u32, Guard> = HashMap::from([(blocks[0].label, guard.clone())]);
        let mut after = Pending::new();
        let mut due = vec![blocks[0].label];
        while let Some(label) = due.pop() {
            let block = blocks.iter().find(|block| block.label == label).unwrap();
            let known = guards[&label].clone();
            let mut pending = entering[&label].clone();
            for instruction in &block.instructions {
                if instruction.code == op::CONTROL_BARRIER {
                    pending.clear();
                } else if instruction.code == op::CALL {
                    pending = self.follow(instruction.operands[2], pending, &known, found);
                } else if let Some(access) = self.access(instruction, &known) {
                    for other in pending.iter().filter(|other| access.is_in_conflict_with(other)) {
                        let name = self.names[&access.variable].clone();
                        found.insert((name, format!("{other:?}, then {access:?}")));
                    }
                    pending.insert(access);
                } else if instruction.code == op::STORE {
                    let variable = self.place(instruction.operands[0]).0;
                    let forget = |mut access: Access| {
                        access.forget(variable);
                        access
                    };
                    pending = pending.into_iter().map(forget).collect();
                }
            }
            let last = block.instructions.last().unwrap();
            if op::ENDS.contains(&last.code) {
                after.extend(pending.clone());
            }
            for (place, &next) in block.next.iter().enumerate() {
                let into = match last.code {
                    op::BRANCH_CONDITIONAL => self.guard_of(last.operands[0], place == 0, &known, &guards),
                    _ => known.clone(),
                };
                let met = guards.get(&next).map_or(into.clone(), |other| other.and(&into));
                let is_changed = guards.insert(next, met.clone()).is_some_and(|other| other != met);
                let is_first = !entering.contains_key(&next);
                let known = entering.entry(next).or_default();
                if is_first || is_changed || !pending.is_subset(known) {
                    known.extend(pending.iter().cloned());
                    due.push(next);
                }
            }
        }
        after
    }

    fn conflicts(&self) -> Conflicts {
        let mut found = Conflicts::new();
        self.follow(self.entry, Pending::new(), &Guard::default(), &mut found);
        found
    }
}

/// The module without its `number`th barrier. `None` if it has fewer.
fn without_barrier(words: &[u32], number: usize) -> Option<Vec<u32>> {
    let mut at = 5;
    let mut count = 0;
    while at < words.len() {
        if words[at] as u16 == op::CONTROL_BARRIER {
            if count == number {
                let length = (words[at] >> 16) as usize;
                return Some([&words[..at], &words[at + length..]].concat());
            }
            count += 1;
        }
        at += (words[at] >> 16) as usize;
    }
    None
}

/// Variables with indices that this check does not understand.
const OTHERWISE: [(&str, &str); 2] = [
    // Invocation 0 overwrites element 0, which no other invocation reads in the last step
    // of the reduction.
    ("clearance", "nearest"),
    // Invocation `lane` reads and writes only row `lane`.
    ("gather", "sums"),
];

#[test]
fn shared_memory_is_read_after_a_barrier() {
    for shader in SHADERS {
        for (name, accesses) in Program::read(&shader.words()).conflicts() {
            assert!(
                OTHERWISE.contains(&(shader.stem, &name)),
                "glsl/{}.comp: `{name}`: {accesses}",
                shader.stem
            );
        }
    }
}

/// The check reports each barrier that is left out.
#[test]
fn no_barrier_can_be_left_out() {
    let (mut count, mut found) = (0, Vec::new());
    for shader in SHADERS {
        let words = shader.words();
        let whole = Program::read(&words).conflicts();
        for number in 0.. {
            let Some(without) = without_barrier(&words, number) else { break };
            if Program::read(&without).conflicts() == whole {
                found.push((shader.stem, number));
            }
            count += 1;
        }
    }
    assert!(found.is_empty(), "{found:?}");
    assert!(count > 25, "{count} barriers");
}

/// The operands of a condition: itself, or both sides of `a || b`, which SPIR-V expresses as a phi.
fn conditions(program: &Program, value: u32) -> Vec<u32> {
    match program.defined.get(&value) {
        Some(Instruction { code: op::PHI, operands }) => {
            operands[2..].chunks_exact(2).map(|way| way[0]).collect()
        }
        _ => vec![value],
    }
}

/// The guard against invocations beyond the end of a list uses `>=`. With `>`, one invocation too
/// many writes beyond the buffer. The device drops this write, so no picture shows it.
#[test]
fn invocations_beyond_a_list_leave() {
    // The first workgroup continues even without values: it writes the total.
    const ONE_MORE: [&str; 1] = ["prefix_sum"];
    let mut guards = 0;
    for shader in SHADERS.iter().filter(|shader| !ONE_MORE.contains(&shader.stem)) {
        let program = Program::read(&shader.words());
        let blocks = &program.functions[&program.entry];
        let leaves = |label: u32| {
            let block = blocks.iter().find(|block| block.label == label);
            block.is_some_and(|block| block.instructions.iter().all(|i| i.code == op::RETURN))
        };
        for end in blocks.iter().filter_map(|block| block.instructions.last()) {
            if end.code != op::BRANCH_CONDITIONAL || !leaves(end.operands[1]) {
                continue;
            }
            for value in conditions(&program, end.operands[0]) {
                let code = program.defined.get(&value).map(|condition| condition.code);
                assert_ne!(
                    code,
                    Some(op::GREATER),
                    "glsl/{}.comp: one invocation too many stays",
                    shader.stem
                );
            }
            guards += 1;
        }
    }
    assert!(guards > 40, "{guards} guards");
}
