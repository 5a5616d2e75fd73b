//! The passes: each a host file, a shader and a CPU twin of one stem.

pub mod frame;

use crate::layout::Layout;

/// The layout of every structure that a pass shares with its shaders: one line a pass.
pub fn layouts() -> Vec<Layout> {
    [frame::prefix_sum::LAYOUTS].concat()
}
