//! `lightpaths demo`: the window.

mod handles;
mod navigate;
