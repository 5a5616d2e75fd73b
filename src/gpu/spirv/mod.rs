//! Reads the declarations of compute shaders from SPIR-V: bindings with access, push block,
//! constants, shared structures.
//!
//! The SPIR-V must contain names (no stripping, no optimiser). Panics on an invalid module: modules
//! are part of the program.

mod code;
pub(super) mod dead_branches;
#[cfg(test)]
mod dead_branches_tests;

use std::collections::HashMap;

/// Access of a shader to a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Declared `readonly`: never written.
    Read,
    /// Declared `writeonly`: never read.
    Write,
    /// Declared neither `readonly` nor `writeonly`.
    ReadWrite,
}

/// A buffer of the shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Number of the descriptor set.
    pub set: u32,
    /// Binding number in the set.
    pub binding: u32,
    /// Name of the block; name of the variable if it is bound as texels.
    pub name: String,
    /// Access of the shader to the buffer.
    pub access: Access,
    /// Whether the buffer is bound as texels of four words (`usamplerBuffer`) instead of storage.
    pub is_texels: bool,
    /// Type of the block's only member, without array brackets. `None` if the block
    /// has several members.
    pub element: Option<String>,
    /// Bytes from one element to the next, if the block is an array of unknown length.
    pub stride: Option<u32>,
}

/// The push constant block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Push {
    /// Type of the block's only member. `None` if the block has several members.
    pub element: Option<String>,
    /// Size in bytes.
    pub size: u32,
}

/// A structure with a memory layout: one that a block uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Structure {
    /// The structure's name.
    pub name: String,
    /// Members in order.
    pub members: Vec<Member>,
}

/// A member of a [`Structure`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// The member's name.
    pub name: String,
    /// Bytes from the start of the structure.
    pub offset: u32,
    /// Size in bytes.
    pub size: u32,
    /// Scalar type or structure at the bottom of vectors, matrices and arrays: `float`, `uint`,
    /// `int`, or a name.
    pub scalar: String,
}

/// A specialisation constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// The `constant_id` of the shader.
    pub id: u32,
    /// Name of the constant. A workgroup size that the host sets has no name in GLSL; it is called
    /// `local_size_x`, `_y` or `_z`.
    pub name: String,
}

/// Declarations of a compute shader.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Module {
    /// Invocations of a workgroup along each axis, before specialisation.
    pub local_size: [u32; 3],
    /// Buffers by set and binding.
    pub bindings: Vec<Binding>,
    /// The push constant block, if any.
    pub push: Option<Push>,
    /// Specialisation constants by id.
    pub constants: Vec<Constant>,
    /// Structures with a memory layout, except the blocks.
    pub structures: Vec<Structure>,
    /// SPIR-V capabilities by number.
    pub capabilities: Vec<u32>,
    /// Names of extended instruction sets: `GLSL.std.450`, and one for printing if a shader prints.
    pub instruction_sets: Vec<String>,
    /// Whether the shader reads the number of workgroups, which it needs to be spread over y.
    pub has_workgroup_count: bool,
}

/// Names of the specialisation constants that are a workgroup's size along x, y and z.
pub const LOCAL_SIZE: [&str; 3] = ["local_size_x", "local_size_y", "local_size_z"];

/// The specialisation constant of kernels that can read lists through addresses. It is 1 if such
/// lists are bound.
pub const USE_BUFFER_DEVICE_ADDRESS: &str = "USE_BUFFER_DEVICE_ADDRESS";

/// The specialisation constant of kernels that intersect triangles. It is 1 if the bound triangles
/// have opacity micromaps.
pub const HAS_CUTOUTS: &str = "HAS_CUTOUTS";

/// The specialisation constant of kernels that trace rays. It is 1 if panes follow the bound nodes.
pub const HAS_PANES: &str = "HAS_PANES";

/// The specialisation constant of kernels that trace rays. It is 1 if regions of the bound scene
/// have smaller cells.
pub const HAS_REGIONS: &str = "HAS_REGIONS";

/// The specialisation constants that follow from the bindings. Callers do not pass them.
pub const FROM_BINDINGS: [&str; 4] = [USE_BUFFER_DEVICE_ADDRESS, HAS_CUTOUTS, HAS_PANES, HAS_REGIONS];

/// Reads the declarations of a module.
pub fn reflect(words: &[u32]) -> Module {
    Reader::parse(words).module()
}

/// An instruction with its operands.
#[derive(Clone, Copy)]
struct Instruction<'a> {
    words: &'a [u32],
}

impl<'a> Instruction<'a> {
    fn opcode(&self) -> u16 {
        self.words[0] as u16
    }

    fn operands(&self) -> &'a [u32] {
        &self.words[1..]
    }

    /// Id of the result, for instructions of functions.
    fn result(&self) -> Option<u32> {
        match (self.opcode(), self.operands()) {
            (code::LABEL, &[id]) => Some(id),
            (opcode, _) if code::WITHOUT_RESULT.contains(&opcode) => None,
            (_, &[_, id, ..]) => Some(id),
            _ => None,
        }
    }
}

/// All instructions of a module.
fn instructions(words: &[u32]) -> impl Iterator<Item = Instruction<'_>> {
    assert!(words.len() > 5 && words[0] == code::MAGIC, "not a SPIR-V module");
    let mut rest = &words[5..];
    std::iter::from_fn(move || {
        let length = (rest.first()? >> 16) as usize;
        assert!((1..=rest.len()).contains(&length), "a SPIR-V instruction has a wrong length");
        let (words, after) = rest.split_at(length);
        rest = after;
        Some(Instruction { words })
    })
}

enum Type {
    Scalar { bytes: u32, name: &'static str },
    Vector { of: u32, count: u32 },
    Matrix { of: u32, columns: u32 },
    Array { of: u32, length: u32 },
    RuntimeArray { of: u32 },
    Struct { members: Vec<u32> },
    Pointer { to: u32 },
}

/// The declarations of a module by id; members of structures are keyed by id and index.
#[derive(Default)]
struct Reader {
    found: Module,
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    decorations: HashMap<(u32, u32), u32>,
    member_decorations: HashMap<(u32, u32, u32), u32>,
    types: HashMap<u32, Type>,
    constants: HashMap<u32, u32>,
    /// Id, type and storage class.
    variables: Vec<(u32, u32, u32)>,
}

impl Reader {
    fn parse(words: &[u32]) -> Self {
        let mut reader = Self::default();
        for instruction in instructions(words) {
            reader.instruction(instruction.opcode(), instruction.operands());
        }
        reader
    }

    fn instruction(&mut self, opcode: u16, operands: &[u32]) {
        match (opcode, operands) {
            (code::CAPABILITY, &[capability]) => self.found.capabilities.push(capability),
            (code::EXT_INST_IMPORT, [_, name @ ..]) => self.found.instruction_sets.push(string(name)),
            (code::EXECUTION_MODE, &[_, code::LOCAL_SIZE, x, y, z]) => self.found.local_size = [x, y, z],
            (code::NAME, [id, name @ ..]) => {
                self.names.insert(*id, string(name));
            }
            (code::MEMBER_NAME, [id, member, name @ ..]) => {
                self.member_names.insert((*id, *member), string(name));
            }
            (code::DECORATE, &[id, decoration, ref value @ ..]) => {
                let value = value.first().copied().unwrap_or(0);
                self.decorations.insert((id, decoration), value);
                self.found.has_workgroup_count |=
                    decoration == code::BUILT_IN && value == code::NUM_WORKGROUPS;
            }
            (code::MEMBER_DECORATE, &[id, member, decoration, ref value @ ..]) => {
                let value = value.first().copied().unwrap_or(0);
                self.member_decorations.insert((id, member, decoration), value);
            }
            (code::CONSTANT | code::SPEC_CONSTANT, &[_, id, value, ..]) => self.constant(opcode, id, value),
            (code::SPEC_CONSTANT_TRUE, &[_, id]) => self.constant(opcode, id, 1),
            (code::SPEC_CONSTANT_FALSE, &[_, id]) => self.constant(opcode, id, 0),
            (code::SPEC_CONSTANT_COMPOSITE, &[_, id, ref parts @ ..])
                if self.decorations.get(&(id, code::BUILT_IN)) == Some(&code::WORKGROUP_SIZE) =>
            {
                self.name_local_size(parts);
            }
            (code::VARIABLE, &[type_id, id, class, ..]) => self.variables.push((id, type_id, class)),
            (_, &[id, ref rest @ ..]) => {
                if let Some(declared) = declared_type(opcode, rest) {
                    self.types.insert(id, declared);
                }
            }
            _ => {}
        }
    }

    /// Reads a constant. Decorations come before constants in a module, so the ids of
    /// specialisation constants are already stored.
    fn constant(&mut self, opcode: u16, id: u32, value: u32) {
        self.constants.insert(id, value);
        if let (true, Some(&spec_id)) = (opcode != code::CONSTANT, self.decorations.get(&(id, code::SPEC_ID)))
        {
            self.found.constants.push(Constant { id: spec_id, name: self.name(id) });
        }
    }

    /// Names the specialisation constants that are a workgroup's size.
    fn name_local_size(&mut self, parts: &[u32]) {
        for (part, name) in parts.iter().zip(LOCAL_SIZE) {
            let spec_id = self.decorations.get(&(*part, code::SPEC_ID));
            let constant = self.found.constants.iter_mut().find(|constant| spec_id == Some(&constant.id));
            if let Some(constant) = constant {
                name.clone_into(&mut constant.name);
            }
        }
    }

    fn module(mut self) -> Module {
        let mut found = std::mem::take(&mut self.found);
        for &(variable, pointer, class) in &self.variables {
            let block = match self.types.get(&pointer) {
                Some(&Type::Pointer { to }) => to,
                _ => continue,
            };
            match class {
                code::STORAGE_BUFFER => found.bindings.push(self.binding(variable, block)),
                code::UNIFORM_CONSTANT => found.bindings.push(self.texels(variable)),
                code::PUSH_CONSTANT => {
                    found.push = Some(Push {
                        element: self.element(block).map(|(name, _)| name),
                        size: self.size(block),
                    });
                }
                _ => {}
            }
        }
        found.bindings.sort_by_key(|binding| (binding.set, binding.binding));
        found.constants.sort_by_key(|constant| constant.id);
        let mut structures: Vec<u32> = self.types.keys().copied().filter(|&id| self.is_shared(id)).collect();
        structures.sort_unstable();
        found.structures = structures.into_iter().map(|id| self.structure(id)).collect();
        found
    }

    fn decoration(&self, variable: u32, which: u32) -> u32 {
        *self.decorations.get(&(variable, which)).expect("a buffer has a descriptor set and a binding")
    }

    fn texels(&self, variable: u32) -> Binding {
        Binding {
            set: self.decoration(variable, code::DESCRIPTOR_SET),
            binding: self.decoration(variable, code::BINDING),
            name: self.name(variable),
            access: Access::Read,
            is_texels: true,
            element: None,
            stride: None,
        }
    }

    fn binding(&self, variable: u32, block: u32) -> Binding {
        // Depending on the compiler, the variable or each of its members carries the qualifier.
        let members = self.members(block).len() as u32;
        let has = |which| {
            self.decorations.contains_key(&(variable, which))
                || (0..members).all(|member| self.member_decorations.contains_key(&(block, member, which)))
        };
        let access = match (has(code::NON_WRITABLE), has(code::NON_READABLE)) {
            (true, _) => Access::Read,
            (false, true) => Access::Write,
            (false, false) => Access::ReadWrite,
        };
        let (element, stride) = self.element(block).unzip();
        Binding {
            set: self.decoration(variable, code::DESCRIPTOR_SET),
            binding: self.decoration(variable, code::BINDING),
            name: self.name(block),
            access,
            is_texels: false,
            element,
            stride: stride.flatten(),
        }
    }

    /// Type of a block's only member, and its stride if that is an array of unknown length.
    fn element(&self, block: u32) -> Option<(String, Option<u32>)> {
        let &[member] = self.members(block) else { return None };
        match self.types[&member] {
            Type::RuntimeArray { of } => Some((self.scalar(of), Some(self.stride(member)))),
            _ => Some((self.scalar(member), None)),
        }
    }

    fn structure(&self, id: u32) -> Structure {
        let member = |(index, &type_id): (usize, &u32)| {
            let key = (id, index as u32);
            Member {
                name: self.member_names.get(&key).cloned().unwrap_or_default(),
                offset: self.member_decorations[&(id, index as u32, code::OFFSET)],
                size: self.member_size(id, index as u32, type_id),
                scalar: self.scalar(type_id),
            }
        };
        Structure { name: self.name(id), members: self.members(id).iter().enumerate().map(member).collect() }
    }

    fn is_shared(&self, id: u32) -> bool {
        !self.members(id).is_empty()
            && self.member_decorations.contains_key(&(id, 0, code::OFFSET))
            && !self.decorations.contains_key(&(id, code::BLOCK))
    }

    fn name(&self, id: u32) -> String {
        self.names.get(&id).cloned().unwrap_or_default()
    }

    fn members(&self, id: u32) -> &[u32] {
        match self.types.get(&id) {
            Some(Type::Struct { members }) => members,
            _ => &[],
        }
    }

    fn stride(&self, array: u32) -> u32 {
        self.decorations.get(&(array, code::ARRAY_STRIDE)).copied().unwrap_or(0)
    }

    fn scalar(&self, id: u32) -> String {
        match self.types[&id] {
            Type::Scalar { name, .. } => name.into(),
            Type::Vector { of, .. } | Type::Matrix { of, .. } => self.scalar(of),
            Type::Array { of, .. } | Type::RuntimeArray { of } => self.scalar(of),
            Type::Struct { .. } | Type::Pointer { .. } => self.name(id),
        }
    }

    /// Bytes from the first member to the end of the last.
    fn size(&self, id: u32) -> u32 {
        match self.types[&id] {
            Type::Scalar { bytes, .. } => bytes,
            Type::Vector { of, count } => count * self.size(of),
            Type::Array { length, .. } => self.constants[&length] * self.stride(id),
            Type::Struct { ref members } => (0..).zip(members).last().map_or(0, |(index, &type_id)| {
                self.member_decorations[&(id, index, code::OFFSET)] + self.member_size(id, index, type_id)
            }),
            Type::Matrix { .. } | Type::RuntimeArray { .. } | Type::Pointer { .. } => 0,
        }
    }

    /// As [`Self::size`], for a member: the stride of a matrix is a decoration of the member.
    fn member_size(&self, id: u32, index: u32, type_id: u32) -> u32 {
        match self.types[&type_id] {
            Type::Matrix { columns, .. } => {
                columns * self.member_decorations[&(id, index, code::MATRIX_STRIDE)]
            }
            _ => self.size(type_id),
        }
    }
}

fn declared_type(opcode: u16, operands: &[u32]) -> Option<Type> {
    Some(match (opcode, operands) {
        (code::TYPE_BOOL, _) => Type::Scalar { bytes: 4, name: "bool" },
        (code::TYPE_INT, &[bits, 0]) => Type::Scalar { bytes: bits / 8, name: "uint" },
        (code::TYPE_INT, &[bits, _]) => Type::Scalar { bytes: bits / 8, name: "int" },
        (code::TYPE_FLOAT, &[bits, ..]) => Type::Scalar { bytes: bits / 8, name: "float" },
        (code::TYPE_VECTOR, &[of, count]) => Type::Vector { of, count },
        (code::TYPE_MATRIX, &[of, columns]) => Type::Matrix { of, columns },
        (code::TYPE_ARRAY, &[of, length]) => Type::Array { of, length },
        (code::TYPE_RUNTIME_ARRAY, &[of]) => Type::RuntimeArray { of },
        (code::TYPE_STRUCT, members) => Type::Struct { members: members.to_vec() },
        (code::TYPE_POINTER, &[_, to]) => Type::Pointer { to },
        _ => return None,
    })
}

/// A SPIR-V string: UTF-8 in little-endian words, ended by a zero byte.
fn string(words: &[u32]) -> String {
    let bytes: Vec<u8> =
        words.iter().flat_map(|word| word.to_le_bytes()).take_while(|&byte| byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}
