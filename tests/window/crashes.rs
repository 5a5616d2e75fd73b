//! Random input in a window whose files change, which is closed and which crashes: no edit is lost.

use image::RgbImage;

use crate::disk::{ASKED, BLUE, BRING_BACK, Desk, LEFT, RED, WHITE, lights, same, scene, shows_question};
use crate::display::Display;
use crate::keys::{self, Chord};
use crate::monkey::Monkey;
use crate::scenarios::{ASKS, SIDE, SOON, close, setting, settled};
use crate::until;

/// Edits, undo, views and camera. Dragged gizmos are edits, too.
const CHORDS: [Chord; 16] = [
    (&[], b'l' as u32),
    (&[], b'l' as u32),
    (&[], b'o' as u32),
    (&[], b'x' as u32),
    (&[keys::CONTROL], b'z' as u32),
    (&[keys::CONTROL], b'z' as u32),
    (&[keys::CONTROL, keys::SHIFT], b'z' as u32),
    (&[], b'w' as u32),
    (&[], b'a' as u32),
    (&[], b's' as u32),
    (&[], b'd' as u32),
    (&[], b'2' as u32),
    (&[], b'3' as u32),
    (&[], b'8' as u32),
    (&[], b'f' as u32),
    (&[], keys::ESCAPE),
];

/// Rounds of a run: each is random actions, a change on disk, an attempt to close, a crash.
struct Rounds<'a> {
    display: &'a Display,
    desk: Desk<'a>,
    round: u64,
}

impl Rounds<'_> {
    /// The picture of the edits alone: without panels, from the scene's camera.
    fn picture(&self) -> RgbImage {
        let client = self.desk.demo.client();
        client.resize((SIDE, SIDE));
        self.desk.demo.assert_presents(SOON);
        client.tap(&[], keys::of('1'));
        client.tap(&[], keys::HOME);
        settled(&self.desk.demo)
    }

    fn has_autosave(&self) -> bool {
        self.desk.path("s-autosave.toml").exists()
    }

    /// The scene's file changes. Unsaved edits are kept by an answer; without, the scene is loaded.
    fn change_on_disk(&self) {
        let text = scene([WHITE, BLUE, RED][self.round as usize % 3]);
        // The same text again is no change.
        let text = format!("# {}\n{text}", self.round);
        if self.has_autosave() {
            let before = self.picture();
            self.desk.write(&text, ASKED);
            self.desk
                .answered("lightpaths: your edits are kept", || self.desk.answer(crate::disk::KEEP_MINE));
            assert!(same(&before, &self.picture()), "round {}: kept", self.round);
        } else {
            self.desk.reloads(|| std::fs::write(self.desk.path("s.toml"), text).unwrap());
        }
    }

    /// The user wants to close the window, and then not.
    fn almost_close(&self) {
        if !self.has_autosave() {
            return;
        }
        let before = self.picture();
        self.desk.answered(ASKS, || self.desk.demo.client().close());
        self.desk.demo.wait_for_answer();
        self.desk.demo.client().tap(&[], keys::ESCAPE);
        until("no question", SOON, || (!shows_question(&self.desk.demo.capture())).then_some(()));
        assert!(same(&before, &self.picture()), "round {}: still there", self.round);
    }

    /// The process is killed, and another one has its edits.
    fn crash(self) -> Self {
        let (before, had_edits) = (self.picture(), self.has_autosave());
        let Self { display, desk, round } = self;
        let this = Self { display, desk: desk.crash(display), round: round + 1 };
        this.desk.demo.client().tap(&[], keys::of('p'));
        assert_eq!(this.desk.count(LEFT), usize::from(had_edits), "round {round}");
        if had_edits {
            let back = "lightpaths: the edits of the last time are back";
            this.desk.answered(back, || this.desk.answer(BRING_BACK));
        }
        let after = this.picture();
        assert!(same(&before, &after), "round {round}: the edits are those of before the crash");
        this
    }
}

/// `LIGHTPATHS_MONKEY_ROUNDS` and `LIGHTPATHS_MONKEY_ACTIONS` set the number of crashes, and of
/// actions before each.
#[test]
fn a_monkey_loses_no_edit() {
    let count = setting("LIGHTPATHS_MONKEY_ROUNDS", 4);
    let seed = setting("LIGHTPATHS_MONKEY_SEED", 1);
    let actions = setting("LIGHTPATHS_MONKEY_ACTIONS", 40);
    let display = Display::start();
    let desk = Desk::open(&display);
    desk.demo.client().tap(&[], keys::of('p'));
    let mut rounds = Rounds { display: &display, desk, round: 0 };
    let mut edited = 0;
    for round in 0..count {
        rounds.picture();
        Monkey::new(&rounds.desk.demo, seed + round, &CHORDS).act(actions);
        rounds.picture();
        if round % 2 == 0 {
            rounds.change_on_disk();
        }
        rounds.almost_close();
        assert_eq!(rounds.desk.count("lightpaths: this edit is not kept"), 0, "round {round}");
        if rounds.has_autosave() {
            edited += 1;
            lights(&rounds.desk.path("s-autosave.toml"));
        }
        rounds = rounds.crash();
    }
    println!("{edited} of {count} crashes with unsaved edits");
    assert!(edited > 0, "the monkey edits");
    close(&rounds.desk.demo);
}
