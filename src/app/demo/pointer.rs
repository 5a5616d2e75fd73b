//! Mouse buttons that are released where egui-winit reports nothing to egui.

use egui::{Event, PointerButton};
use winit::event::{ElementState, MouseButton, WindowEvent};

const BUTTONS: [(MouseButton, PointerButton); 3] = [
    (MouseButton::Left, PointerButton::Primary),
    (MouseButton::Right, PointerButton::Secondary),
    (MouseButton::Middle, PointerButton::Middle),
];

/// Completes what egui-winit has made of an event. A release is lost to it where the pointer is not
/// over the window: the window shrank under a drag. A window that is minimised during a drag gets
/// no release. Edits while a button seems held are neither undo steps nor in the autosave.
pub(super) fn release_lost_buttons(panels: &mut egui_winit::State, event: &WindowEvent) {
    match event {
        WindowEvent::MouseInput { state: ElementState::Released, button, .. }
            if !panels.is_pointer_in_window() =>
        {
            let known = BUTTONS.into_iter().find(|(known, _)| known == button);
            release(panels, known.into_iter().map(|(_, button)| button));
        }
        WindowEvent::Focused(false) | WindowEvent::Occluded(true) => {
            release(panels, BUTTONS.map(|(_, button)| button));
        }
        _ => (),
    }
}

/// Reports the release of those of `buttons` that are down, where the pointer was last.
fn release(panels: &mut egui_winit::State, buttons: impl IntoIterator<Item = PointerButton>) {
    let context = panels.egui_ctx().clone();
    let input = panels.egui_input_mut();
    for button in buttons {
        let (mut is_down, mut last) =
            context.input(|input| (input.pointer.button_down(button), input.pointer.interact_pos()));
        // Events that the next frame will take.
        for event in &input.events {
            match *event {
                Event::PointerButton { button: other, pressed, pos, .. } => {
                    last = Some(pos);
                    if other == button {
                        is_down = pressed;
                    }
                }
                Event::PointerMoved(pos) => last = Some(pos),
                _ => (),
            }
        }
        if let (true, Some(pos)) = (is_down, last) {
            let modifiers = context.input(|input| input.modifiers);
            input.events.push(Event::PointerButton { pos, button, pressed: false, modifiers });
            input.events.push(Event::PointerGone);
        }
    }
}

#[cfg(test)]
mod tests {
    use raw_window_handle::{DisplayHandle, HandleError, HasDisplayHandle};

    use super::*;

    fn panels() -> egui_winit::State {
        let context = egui::Context::default();
        egui_winit::State::new(context, egui::ViewportId::ROOT, &NoDisplay, None, None, None)
    }

    fn frame(panels: &mut egui_winit::State) {
        let input = std::mem::take(panels.egui_input_mut());
        let mut output = panels.egui_ctx().clone().run_ui(input, |_| ());
        output.textures_delta.clear();
    }

    fn is_down(panels: &egui_winit::State) -> bool {
        panels.egui_ctx().input(|input| input.pointer.any_down())
    }

    fn press(panels: &mut egui_winit::State) {
        let pos = egui::pos2(3.0, 4.0);
        panels.egui_input_mut().events.extend([
            Event::PointerMoved(pos),
            Event::PointerButton {
                pos,
                button: PointerButton::Primary,
                pressed: true,
                modifiers: egui::Modifiers::NONE,
            },
        ]);
    }

    /// There is nothing behind it: no clipboard.
    struct NoDisplay;

    impl HasDisplayHandle for NoDisplay {
        fn display_handle(&self) -> Result<DisplayHandle<'_>, HandleError> {
            Err(HandleError::Unavailable)
        }
    }

    #[test]
    fn a_button_is_released_when_the_window_is_left() {
        let mut panels = panels();
        for frames_between in [0, 1] {
            press(&mut panels);
            for _ in 0..frames_between {
                frame(&mut panels);
                assert!(is_down(&panels));
            }
            release_lost_buttons(&mut panels, &WindowEvent::Focused(false));
            // There is nothing more to release.
            let count = panels.egui_input().events.len();
            release_lost_buttons(&mut panels, &WindowEvent::Occluded(true));
            assert_eq!(panels.egui_input().events.len(), count);
            frame(&mut panels);
            assert!(!is_down(&panels), "{frames_between}");
        }
    }
}
