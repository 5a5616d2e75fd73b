//! Structures that Rust and GLSL share, and their layouts, which `tests/interface.rs` compares
//! with the SPIR-V.
//!
//! Every buffer and push block uses `scalar` layout. `#[repr(C)]` and GLSL then agree if the
//! members agree. The test compares name, order, offset, size and scalar type of the members.

/// One member of a shared structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Member {
    /// The member's name, the same in Rust and GLSL.
    pub name: &'static str,
    /// Bytes from the start of the structure.
    pub offset: usize,
    /// Size in bytes.
    pub size: usize,
    /// The Rust type as written.
    pub rust_type: &'static str,
}

/// The layout of a shared structure as Rust sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The structure's name, the same in Rust and GLSL.
    pub name: &'static str,
    /// Size in bytes, which is also the stride of an array of it.
    pub size: usize,
    /// Members in order.
    pub members: &'static [Member],
}

/// A structure declared by `gpu_struct!`.
pub trait GpuStruct: bytemuck::Pod {
    /// Its layout in memory.
    const LAYOUT: Layout;
}

/// Declares a structure shared with GLSL: `repr(C)`, `Pod`, and a [`GpuStruct::LAYOUT`].
///
/// Implicit padding is a compile error (from the `Pod` derive). List the structure in
/// its pass's `LAYOUTS`.
macro_rules! gpu_struct {
    ($(#[$meta:meta])* $vis:vis struct $name:ident {
        $($(#[$member_meta:meta])* $member_vis:vis $member:ident: $type:ty),* $(,)?
    }) => {
        $(#[$meta])*
        #[allow(missing_docs, reason = "a comment would repeat most names")]
        #[repr(C)]
        #[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
        $vis struct $name {
            $($(#[$member_meta])* $member_vis $member: $type),*
        }

        impl $crate::layout::GpuStruct for $name {
            const LAYOUT: $crate::layout::Layout = $crate::layout::Layout {
                name: stringify!($name),
                size: size_of::<$name>(),
                members: &[$($crate::layout::Member {
                    name: stringify!($member),
                    offset: core::mem::offset_of!($name, $member),
                    size: size_of::<$type>(),
                    rust_type: stringify!($type),
                }),*],
            };
        }
    };
}
pub(crate) use gpu_struct;
