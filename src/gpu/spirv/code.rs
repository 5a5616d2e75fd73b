//! Opcodes, decorations, storage classes and modes of the SPIR-V specification.

pub(super) const MAGIC: u32 = 0x0723_0203;
pub(super) const NAME: u16 = 5;
pub(super) const MEMBER_NAME: u16 = 6;
pub(super) const EXT_INST_IMPORT: u16 = 11;
pub(super) const ENTRY_POINT: u16 = 15;
pub(super) const EXECUTION_MODE: u16 = 16;
pub(super) const CAPABILITY: u16 = 17;
pub(super) const TYPE_BOOL: u16 = 20;
pub(super) const TYPE_INT: u16 = 21;
pub(super) const TYPE_FLOAT: u16 = 22;
pub(super) const TYPE_VECTOR: u16 = 23;
pub(super) const TYPE_MATRIX: u16 = 24;
pub(super) const TYPE_ARRAY: u16 = 28;
pub(super) const TYPE_RUNTIME_ARRAY: u16 = 29;
pub(super) const TYPE_STRUCT: u16 = 30;
pub(super) const TYPE_POINTER: u16 = 32;
pub(super) const CONSTANT_TRUE: u16 = 41;
pub(super) const CONSTANT_FALSE: u16 = 42;
pub(super) const CONSTANT: u16 = 43;
pub(super) const SPEC_CONSTANT_TRUE: u16 = 48;
pub(super) const SPEC_CONSTANT_FALSE: u16 = 49;
pub(super) const SPEC_CONSTANT: u16 = 50;
pub(super) const SPEC_CONSTANT_COMPOSITE: u16 = 51;
pub(super) const SPEC_CONSTANT_OP: u16 = 52;
pub(super) const FUNCTION: u16 = 54;
pub(super) const FUNCTION_END: u16 = 56;
pub(super) const FUNCTION_CALL: u16 = 57;
pub(super) const VARIABLE: u16 = 59;
pub(super) const STORE: u16 = 62;
pub(super) const COPY_MEMORY: u16 = 63;
pub(super) const DECORATE: u16 = 71;
pub(super) const MEMBER_DECORATE: u16 = 72;
pub(super) const IMAGE_WRITE: u16 = 99;
pub(super) const LOGICAL_EQUAL: u16 = 164;
pub(super) const LOGICAL_NOT_EQUAL: u16 = 165;
pub(super) const LOGICAL_OR: u16 = 166;
pub(super) const LOGICAL_AND: u16 = 167;
pub(super) const LOGICAL_NOT: u16 = 168;
pub(super) const SELECT: u16 = 169;
pub(super) const I_EQUAL: u16 = 170;
pub(super) const I_NOT_EQUAL: u16 = 171;
pub(super) const U_GREATER_THAN: u16 = 172;
pub(super) const U_GREATER_THAN_EQUAL: u16 = 174;
pub(super) const U_LESS_THAN: u16 = 176;
pub(super) const U_LESS_THAN_EQUAL: u16 = 178;
pub(super) const CONTROL_BARRIER: u16 = 224;
pub(super) const MEMORY_BARRIER: u16 = 225;
pub(super) const ATOMIC_STORE: u16 = 228;
pub(super) const PHI: u16 = 245;
pub(super) const LOOP_MERGE: u16 = 246;
pub(super) const SELECTION_MERGE: u16 = 247;
pub(super) const LABEL: u16 = 248;
pub(super) const BRANCH: u16 = 249;
pub(super) const BRANCH_CONDITIONAL: u16 = 250;
pub(super) const SWITCH: u16 = 251;
pub(super) const UNREACHABLE: u16 = 255;

/// Instructions of functions that have two operands and no result.
pub(super) const WITHOUT_RESULT: [u16; 10] = [
    STORE,
    COPY_MEMORY,
    IMAGE_WRITE,
    CONTROL_BARRIER,
    MEMORY_BARRIER,
    ATOMIC_STORE,
    LOOP_MERGE,
    SELECTION_MERGE,
    BRANCH_CONDITIONAL,
    SWITCH,
];

pub(super) const LOCAL_SIZE: u32 = 17;

pub(super) const SPEC_ID: u32 = 1;
pub(super) const BLOCK: u32 = 2;
pub(super) const ARRAY_STRIDE: u32 = 6;
pub(super) const MATRIX_STRIDE: u32 = 7;
pub(super) const BUILT_IN: u32 = 11;
pub(super) const NON_WRITABLE: u32 = 24;
pub(super) const NON_READABLE: u32 = 25;
pub(super) const BINDING: u32 = 33;
pub(super) const DESCRIPTOR_SET: u32 = 34;
pub(super) const OFFSET: u32 = 35;

pub(super) const NUM_WORKGROUPS: u32 = 24;
pub(super) const WORKGROUP_SIZE: u32 = 25;
pub(super) const UNIFORM_CONSTANT: u32 = 0;
pub(super) const PUSH_CONSTANT: u32 = 9;
pub(super) const STORAGE_BUFFER: u32 = 12;
