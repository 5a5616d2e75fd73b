//! Images of materials that the user chooses.

use std::fs;

use super::super::images::{choose_image, remove_image};
use super::super::ui_state::Chosen;
use super::{context, folder, open, picture, saved};

#[test]
fn images_are_chosen_and_removed_like_a_cold_start() {
    let (context, folder) = (context(), folder());
    let at = |name: &str| folder.path().join(name);
    let checks =
        |x: u32, y: u32| image::Rgb(if (x + y).is_multiple_of(2) { [230, 60, 20] } else { [20, 60, 230] });
    image::RgbImage::from_fn(8, 4, checks).save(at("checks.png")).unwrap();
    let mut session = open(&context, &at("s.toml"), |_| ());
    let first = picture(&mut session);
    let room = Chosen::Material(0);

    choose_image(&mut session, &room, &at("checks.png"));
    session.history.settle(&session.document);
    let with_image = picture(&mut session);
    assert!(session.alarm.is_none(), "{:?}", session.said);
    let [steps, _] = session.history.depths();
    session.history.settle(&session.document);
    assert_eq!((steps, session.history.depths()), (1, [1, 0]), "one step");
    let (text, expected) = saved(&context, &mut session, folder.path());
    assert!(text.contains("image = \"checks.png\"") && !text.contains("diffuse"), "{text}");
    assert!(with_image == expected, "not the picture of the saved scene");

    remove_image(&mut session, 0);
    session.history.settle(&session.document);
    let plain = picture(&mut session);
    let mean = session.document.materials[0].diffuse;
    assert!(mean.x > 0.3 && (mean.x - mean.z).abs() < 1e-4, "the mean of red and blue: {mean}");
    let (text, expected) = saved(&context, &mut session, folder.path());
    assert!(text.contains("diffuse = ") && !text.contains("image"), "{text}");
    assert!(plain == expected, "not the picture of the saved scene");
    assert!(first != with_image && with_image != plain && plain != first);

    for expected in [&with_image, &first] {
        session.history.undo(&mut session.document);
        assert!(picture(&mut session) == *expected);
    }
}

#[test]
fn chosen_images_come_back_after_a_crash_or_are_refused() {
    let (context, folder) = (context(), folder());
    let at = |name: &str| folder.path().join(name);
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 100, 50])).save(at("a.png")).unwrap();
    fs::write(at("broken.png"), "no image").unwrap();
    let with_image = format!("{}[[material]]\nname = \"(none)\"\nimage = \"a.png\"\n", super::SCENE);
    fs::write(at("with.toml"), with_image).unwrap();
    let mut session = open(&context, &at("s.toml"), |_| ());
    let first = picture(&mut session);
    let name = session.scene.materials[0].name.clone();
    fs::write(at("with.toml"), fs::read_to_string(at("with.toml")).unwrap().replace("(none)", &name))
        .unwrap();

    // What another window had chosen, and back.
    session.restore(at("with.toml").to_str().unwrap()).unwrap();
    let restored = picture(&mut session);
    let mut other = open(&context, &at("with.toml"), |_| ());
    assert!(restored == picture(&mut other) && restored != first);
    other.restore(at("s.toml").to_str().unwrap()).unwrap();
    assert!(picture(&mut other) == first, "an image that is gone is a colour");

    // A file that holds no image, and one that is chosen for nothing; for a colour, then an image.
    session.history.undo(&mut session.document);
    for (steps, expected) in [([0, 1], first), ([1, 0], restored)] {
        for (chosen, file, why) in
            [(Chosen::Material(0), "broken.png", "broken.png"), (Chosen::Nothing, "a.png", "click a surface")]
        {
            assert!(picture(&mut session) == expected, "before {file}");
            let before = session.document.clone();
            choose_image(&mut session, &chosen, &at(file));
            session.history.settle(&session.document);
            assert!(picture(&mut session) == expected && session.document == before, "{file}");
            let (said, _) = session.alarm.take().expect("an alarm");
            assert!(said.contains(why), "{said}");
        }
        assert_eq!(session.history.depths()[0], steps[0]);
        session.restore(at("with.toml").to_str().unwrap()).unwrap();
    }
}
