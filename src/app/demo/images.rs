//! Images of materials that the user chooses. The scene is loaded anew with them.

use std::path::Path;

use glam::Vec3;

use super::document::ChosenImage;
use super::session::Session;
use super::ui_state::Chosen;
use crate::scene::material::MAX_ALBEDO;

/// Gives the chosen material an image.
pub(super) fn choose_image(session: &mut Session, chosen: &Chosen, path: &Path) {
    if let Err(why) = &session.text {
        session.alarm(format!("the image stays: {why}"));
        return;
    }
    let Chosen::Material(index) = *chosen else {
        return session.alarm("click a surface first: the image becomes that of its material".to_owned());
    };
    // Relative paths would count from the scene file.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let path = path.to_string_lossy().into_owned();
    for other in of_same_name(session, index) {
        let edit = &mut session.document.materials[other];
        if session.scene.materials[other].texture.is_none() {
            // The image provides the colour.
            edit.diffuse = (Vec3::splat(MAX_ALBEDO) - edit.specular).max(Vec3::ZERO);
        }
        session.document.parts.images[other] = Some(ChosenImage::File(path.clone(), edit.diffuse));
    }
}

/// Takes the image from a material, which then has the mean colour of the image.
pub(super) fn remove_image(session: &mut Session, index: usize) {
    for other in of_same_name(session, index) {
        let edit = &mut session.document.materials[other];
        if let Some(texture) = &session.scene.materials[other].texture {
            edit.diffuse *= texture.image.mean();
        }
        session.document.parts.images[other] = Some(ChosenImage::Colour(edit.diffuse));
    }
}

/// The material and all others of its name: a scene file has one section for them.
fn of_same_name(session: &Session, index: usize) -> Vec<usize> {
    let materials = &session.scene.materials;
    (0..materials.len()).filter(|&other| materials[other].name == materials[index].name).collect()
}
