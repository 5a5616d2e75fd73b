//! Handles of lights: drawn over the picture, taken hold of, dragged.
