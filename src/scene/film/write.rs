//! Films from what was done in the window.
