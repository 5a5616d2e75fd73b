//! Luminaires: lights whose intensity in each direction was measured.

mod eulumdat;
mod ies;
mod profile;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3, Vec3};

use super::builtin::Files;
use super::limits;
use super::value::Section;
use crate::{Error, Result, files};

pub(crate) use profile::Grid;
pub use profile::Profile;

/// The measured intensity of a spot, and its turn about the axis.
#[derive(Clone, Debug)]
pub struct Luminaire {
    /// Intensity in each direction.
    pub profile: Arc<Profile>,
    /// File that it was read from.
    pub file: PathBuf,
    /// Turn of the plane C0 about the axis, radians; counter-clockwise for someone whom the light
    /// leaves behind: from above, for a light that points down.
    pub turn: f32,
}

/// The same light, whatever file it was read from.
impl PartialEq for Luminaire {
    fn eq(&self, other: &Self) -> bool {
        let is_same = Arc::ptr_eq(&self.profile, &other.profile) || self.profile == other.profile;
        is_same && self.turn == other.turn
    }
}

impl Luminaire {
    /// Reads the file that a light names. `None` if it names none.
    pub(super) fn read(section: &Section, files: &Files) -> Result<Option<Self>> {
        let Some(name) = section.text("ies")? else {
            return match section.get("turn") {
                Some(_) => Err(section.fault_at("turn", "belongs to a light with `ies`")),
                None => Ok(None),
            };
        };
        if section.text("kind")? != Some("spot") {
            return Err(section.fault_at("ies", "belongs to a light of kind \"spot\""));
        }
        if let Some(key) = ["angle", "penumbra"].into_iter().find(|key| section.get(key).is_some()) {
            return Err(section.fault_at(key, "is that of the file `ies`: leave it out"));
        }
        let file = section.file().with_file_name(name);
        let fault = |why: String| section.fault_at("ies", format!("{name:?} {why}"));
        let bytes = files.read(&file, limits::IES_BYTES).map_err(fault)?;
        let profile = Profile::from_bytes(&bytes).map_err(fault)?;
        let turn = section.number("turn", -360.0..=360.0)?.unwrap_or(0.0).to_radians() as f32;
        Ok(Some(Self { profile: Arc::new(profile), file, turn }))
    }

    /// Reads a photometric file. The luminaire is not turned.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that cannot be read, or is no photometric file.
    pub fn open(file: &Path) -> Result<Self> {
        let fault = |why: String| Error::input(file, why);
        let bytes = files::read(file, limits::IES_BYTES).map_err(|unread| fault(unread.to_string()))?;
        let profile = Profile::from_bytes(&bytes).map_err(fault)?;
        Ok(Self { profile: Arc::new(profile), file: file.to_owned(), turn: 0.0 })
    }

    /// Unit direction at a right angle to the `axis` in which the plane C0 lies. For a light that
    /// points down, without turn, it is +X, and the plane C90 is -Z.
    pub fn c0(&self, axis: Vec3) -> DVec3 {
        let axis = axis.as_dvec3().normalize();
        let tilt = match axis.y > 1.0 - 1e-12 {
            true => DQuat::from_rotation_x(std::f64::consts::PI),
            false => DQuat::from_rotation_arc(DVec3::NEG_Y, axis),
        };
        DQuat::from_axis_angle(-axis, f64::from(self.turn)) * (tilt * DVec3::X)
    }
}
