//! Moving the camera by hand.
