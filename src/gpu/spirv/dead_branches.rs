//! Removes what the specialisation constants of a shader switch off. A driver inlines all calls
//! before it folds constants, so that switched-off code costs most of the compilation: lavapipe
//! compiles the Box's shaders in half the time without it. In: a SPIR-V module, values of its
//! constants. Out: the module without dead branches and uncalled functions; results do not change.

use super::{Instruction, code, instructions};
use std::collections::{HashMap, HashSet};

/// Words of the module's header.
const HEADER: usize = 5;

/// The module without the branches that `values` switch off; each is the id and the value of a
/// specialisation constant. Constants keep their declarations.
pub(in crate::gpu) fn remove(words: &[u32], values: &[(u32, u32)]) -> Vec<u32> {
    let module = Module::parse(words);
    let known = module.constants(values);
    let functions = module.called(&known);
    let mut removed = HashSet::new();
    let mut bodies = Vec::new();
    for (function, live) in module.functions.iter().zip(&functions) {
        match live {
            Some(live) => function.write(live, &mut bodies, &mut removed),
            None => removed.extend(function.instructions().filter_map(|instruction| instruction.result())),
        }
    }
    let mut out = words[..HEADER].to_vec();
    for declaration in module.declarations {
        // Names and decorations of results that are gone.
        let is_about = |id: &u32| removed.contains(id);
        if !(matches!(declaration.opcode(), code::NAME | code::DECORATE)
            && is_about(&declaration.operands()[0]))
        {
            out.extend(declaration.words);
        }
    }
    out.extend(bodies);
    out
}

/// A module in parts.
struct Module<'a> {
    /// All before the first function.
    declarations: Vec<Instruction<'a>>,
    functions: Vec<Function<'a>>,
}

struct Function<'a> {
    /// The function and its parameters.
    head: Vec<Instruction<'a>>,
    blocks: Vec<Block<'a>>,
}

/// A basic block: no instruction but the last one branches.
struct Block<'a> {
    label: Instruction<'a>,
    instructions: Vec<Instruction<'a>>,
}

/// Values of results, by id.
type Known = HashMap<u32, u32>;

/// What a function executes.
#[derive(Default)]
struct Live {
    known: Known,
    /// Labels of the blocks that it reaches.
    labels: HashSet<u32>,
    /// Edges that it takes, from label to label.
    edges: HashSet<(u32, u32)>,
}

impl<'a> Module<'a> {
    fn parse(words: &'a [u32]) -> Self {
        let mut module = Self { declarations: Vec::new(), functions: Vec::new() };
        for instruction in instructions(words) {
            match (instruction.opcode(), module.functions.last_mut()) {
                (code::FUNCTION, _) => {
                    module.functions.push(Function { head: vec![instruction], blocks: Vec::new() });
                }
                (_, None) => module.declarations.push(instruction),
                (code::FUNCTION_END, _) => {}
                (code::LABEL, Some(function)) => {
                    function.blocks.push(Block { label: instruction, instructions: Vec::new() });
                }
                (_, Some(function)) => match function.blocks.last_mut() {
                    Some(block) => block.instructions.push(instruction),
                    None => function.head.push(instruction),
                },
            }
        }
        module
    }

    /// Values of all constants of one word.
    fn constants(&self, values: &[(u32, u32)]) -> Known {
        let mut known = Known::new();
        let mut given = HashMap::new();
        for declaration in &self.declarations {
            let value = match (declaration.opcode(), declaration.operands()) {
                (code::DECORATE, &[id, code::SPEC_ID, constant]) => {
                    let value = values.iter().find(|(id, _)| *id == constant);
                    given.extend(value.map(|&(_, value)| (id, value)));
                    None
                }
                (code::CONSTANT, &[_, id, value]) => Some((id, value)),
                (code::CONSTANT_TRUE, &[_, id]) => Some((id, 1)),
                (code::CONSTANT_FALSE, &[_, id]) => Some((id, 0)),
                (code::SPEC_CONSTANT, &[_, id, default]) => Some((id, *given.get(&id).unwrap_or(&default))),
                (code::SPEC_CONSTANT_TRUE, &[_, id]) => Some((id, *given.get(&id).unwrap_or(&1))),
                (code::SPEC_CONSTANT_FALSE, &[_, id]) => Some((id, *given.get(&id).unwrap_or(&0))),
                (code::SPEC_CONSTANT_OP, &[_, id, opcode, ref operands @ ..]) => {
                    value_of(opcode as u16, operands, &known).map(|value| (id, value))
                }
                _ => None,
            };
            known.extend(value);
        }
        known
    }

    /// What each function executes; `None` if the entry point does not call it.
    fn called(&self, known: &Known) -> Vec<Option<Live>> {
        let index_of: HashMap<u32, usize> =
            self.functions.iter().enumerate().map(|(index, function)| (function.id(), index)).collect();
        let mut found: Vec<Option<Live>> = self.functions.iter().map(|_| None).collect();
        let entries =
            self.declarations.iter().filter(|declaration| declaration.opcode() == code::ENTRY_POINT);
        let mut open: Vec<u32> = entries.map(|entry| entry.operands()[1]).collect();
        while let Some(id) = open.pop() {
            let index = index_of[&id];
            if found[index].is_none() {
                let live = self.functions[index].live(known);
                open.extend(self.functions[index].calls(&live));
                found[index] = Some(live);
            }
        }
        found
    }
}

impl<'a> Function<'a> {
    fn id(&self) -> u32 {
        self.head[0].operands()[1]
    }

    fn instructions(&'a self) -> impl Iterator<Item = &'a Instruction<'a>> {
        let of_block = |block: &'a Block<'a>| std::iter::once(&block.label).chain(&block.instructions);
        self.head.iter().chain(self.blocks.iter().flat_map(of_block))
    }

    /// What is reached if the given values are known.
    fn live(&self, constants: &Known) -> Live {
        let mut live = Live { known: constants.clone(), ..Live::default() };
        loop {
            self.reach(&mut live);
            let before = live.known.len();
            for block in self.blocks.iter().filter(|block| live.labels.contains(&block.id())) {
                for instruction in &block.instructions {
                    let value = match (instruction.opcode(), instruction.operands()) {
                        (code::PHI, &[_, _, ref pairs @ ..]) => live.common_value(block.id(), pairs),
                        (opcode, &[_, _, ref operands @ ..]) => value_of(opcode, operands, &live.known),
                        _ => None,
                    };
                    live.known.extend(instruction.result().zip(value));
                }
            }
            // Another known value may end another branch.
            if live.known.len() == before {
                return live;
            }
        }
    }

    /// The blocks and edges from the first block on.
    fn reach(&self, live: &mut Live) {
        let block_of: HashMap<u32, &Block<'_>> =
            self.blocks.iter().map(|block| (block.id(), block)).collect();
        (live.labels, live.edges) = Default::default();
        let mut open: Vec<u32> = self.blocks.first().map(Block::id).into_iter().collect();
        while let Some(label) = open.pop() {
            if live.labels.insert(label) {
                let targets = block_of[&label].targets(&live.known);
                live.edges.extend(targets.iter().map(|&target| (label, target)));
                open.extend(targets);
            }
        }
    }

    /// Functions that are called.
    fn calls(&self, live: &Live) -> impl Iterator<Item = u32> {
        let blocks = self.blocks.iter().filter(|block| live.labels.contains(&block.id()));
        let instructions = blocks.flat_map(|block| &block.instructions);
        let calls = instructions.filter(|instruction| instruction.opcode() == code::FUNCTION_CALL);
        calls.map(|call| call.operands()[2])
    }

    /// Writes what is live. Adds the ids that are gone to `removed`.
    fn write(&self, live: &Live, out: &mut Vec<u32>, removed: &mut HashSet<u32>) {
        let is_live = |block: &&Block<'_>| live.labels.contains(&block.id());
        // A header that stays names its merge block, and that of a loop the block that continues
        // it, whether or not these are reached.
        let (mut merges, mut continues) = (HashSet::new(), HashMap::new());
        for block in self.blocks.iter().filter(is_live) {
            match block.merge(&live.known).map(|merge| (merge.opcode(), merge.operands())) {
                Some((code::LOOP_MERGE, &[merge, again, ..])) => {
                    merges.insert(merge);
                    continues.insert(again, block.id());
                }
                Some((_, &[merge, ..])) => {
                    merges.insert(merge);
                }
                _ => {}
            }
        }
        out.extend(self.head.iter().flat_map(|instruction| instruction.words));
        for block in &self.blocks {
            if is_live(&block) {
                block.write(live, out);
                continue;
            }
            removed.extend(block.instructions.iter().filter_map(Instruction::result));
            let last: &[u32] = match (continues.get(&block.id()), merges.contains(&block.id())) {
                (Some(&header), _) => &[2 << 16 | u32::from(code::BRANCH), header],
                (None, true) => &[1 << 16 | u32::from(code::UNREACHABLE)],
                (None, false) => {
                    removed.insert(block.id());
                    continue;
                }
            };
            out.extend(block.label.words);
            out.extend(last);
        }
        out.push(1 << 16 | u32::from(code::FUNCTION_END));
    }
}

impl<'a> Block<'a> {
    fn id(&self) -> u32 {
        self.label.operands()[0]
    }

    fn last(&self) -> &Instruction<'a> {
        self.instructions.last().expect("a block ends with a branch or a return")
    }

    /// The only target of a conditional branch whose condition is known.
    fn decided(&self, known: &Known) -> Option<u32> {
        match (self.last().opcode(), self.last().operands()) {
            (code::BRANCH_CONDITIONAL, &[condition, if_true, if_false, ..]) => {
                known.get(&condition).map(|&value| if value != 0 { if_true } else { if_false })
            }
            _ => None,
        }
    }

    /// Labels that may follow.
    fn targets(&self, known: &Known) -> Vec<u32> {
        if let Some(target) = self.decided(known) {
            return vec![target];
        }
        match (self.last().opcode(), self.last().operands()) {
            (code::BRANCH, &[target]) => vec![target],
            (code::BRANCH_CONDITIONAL, &[_, if_true, if_false, ..]) => vec![if_true, if_false],
            (code::SWITCH, &[_, default, ref cases @ ..]) => {
                // Selectors have one word.
                std::iter::once(default).chain(cases.chunks_exact(2).map(|case| case[1])).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The instruction that makes the block the header of a selection or a loop. A selection that
    /// is decided needs none.
    fn merge(&self, known: &Known) -> Option<&Instruction<'a>> {
        let before = self.instructions.len().checked_sub(2).map(|index| &self.instructions[index])?;
        match before.opcode() {
            code::LOOP_MERGE => Some(before),
            code::SELECTION_MERGE => Some(before).filter(|_| self.decided(known).is_none()),
            _ => None,
        }
    }

    fn write(&self, live: &Live, out: &mut Vec<u32>) {
        out.extend(self.label.words);
        let decided = self.decided(&live.known);
        for instruction in &self.instructions {
            match (instruction.opcode(), decided) {
                (code::SELECTION_MERGE, Some(_)) => {}
                (code::BRANCH_CONDITIONAL, Some(target)) => {
                    out.extend([2 << 16 | u32::from(code::BRANCH), target]);
                }
                (code::PHI, _) => {
                    let &[type_id, id, ref pairs @ ..] = instruction.operands() else { unreachable!() };
                    let taken: Vec<u32> = live.taken(self.id(), pairs).flatten().copied().collect();
                    out.push((3 + taken.len() as u32) << 16 | u32::from(code::PHI));
                    out.extend([type_id, id]);
                    out.extend(taken);
                }
                _ => out.extend(instruction.words),
            }
        }
    }
}

impl Live {
    /// The pairs of value and predecessor of a phi in that block whose edges are taken.
    fn taken<'p>(&self, block: u32, pairs: &'p [u32]) -> impl Iterator<Item = &'p [u32; 2]> {
        let (pairs, _) = pairs.as_chunks::<2>();
        pairs.iter().filter(move |[_, from]| self.edges.contains(&(*from, block)))
    }

    /// The value that all taken edges bring.
    fn common_value(&self, block: u32, pairs: &[u32]) -> Option<u32> {
        let mut values = self.taken(block, pairs).map(|[value, _]| self.known.get(value).copied());
        let first = values.next().flatten()?;
        values.all(|value| value == Some(first)).then_some(first)
    }
}

/// The value of an operation of logic or comparison, if its operands determine it.
fn value_of(opcode: u16, operands: &[u32], known: &Known) -> Option<u32> {
    let value = |index: usize| operands.get(index).and_then(|id| known.get(id)).copied();
    let either = |decides: u32| [value(0), value(1)].contains(&Some(decides)).then_some(decides);
    let compared =
        |compare: fn(u32, u32) -> bool| value(0).zip(value(1)).map(|(a, b)| u32::from(compare(a, b)));
    match opcode {
        code::LOGICAL_NOT => value(0).map(|value| 1 - value),
        code::LOGICAL_AND => either(0).or_else(|| compared(|a, b| a & b != 0)),
        code::LOGICAL_OR => either(1).or_else(|| compared(|a, b| a | b != 0)),
        code::I_EQUAL | code::LOGICAL_EQUAL => compared(|a, b| a == b),
        code::I_NOT_EQUAL | code::LOGICAL_NOT_EQUAL => compared(|a, b| a != b),
        code::U_GREATER_THAN => compared(|a, b| a > b),
        code::U_GREATER_THAN_EQUAL => compared(|a, b| a >= b),
        code::U_LESS_THAN => compared(|a, b| a < b),
        code::U_LESS_THAN_EQUAL => compared(|a, b| a <= b),
        code::SELECT => value(0).and_then(|condition| value(if condition != 0 { 1 } else { 2 })),
        _ => None,
    }
}
