//! The choice of lights: one of them is the primary one, whose properties the panel shows.

use egui::Modifiers;

use super::ui_state::{Chosen, UiState};

impl UiState {
    /// Chooses an item alone.
    pub(super) fn choose(&mut self, chosen: Chosen) {
        self.chosen = chosen;
        self.other_lights.clear();
    }

    /// The chosen lights, the primary one first.
    pub(super) fn chosen_lights(&self) -> Vec<u64> {
        match self.chosen {
            Chosen::Light(primary) => [&[primary][..], &self.other_lights].concat(),
            _ => Vec::new(),
        }
    }

    pub(super) fn has_chosen(&self, light: u64) -> bool {
        self.chosen_lights().contains(&light)
    }

    /// The lights that an edit of this one changes: all chosen ones if it is chosen, too.
    pub(super) fn edited_with(&self, light: u64) -> Vec<u64> {
        if self.has_chosen(light) { self.chosen_lights() } else { vec![light] }
    }

    /// Chooses lights, the first as the primary one.
    pub(super) fn choose_lights(&mut self, lights: &[u64]) {
        match lights {
            [] => self.choose(Chosen::Nothing),
            [primary, others @ ..] => {
                (self.chosen, self.other_lights) = (Chosen::Light(*primary), others.to_vec());
            }
        }
    }

    /// Adds a light to the chosen ones, or takes it out of them.
    pub(super) fn toggle_chosen(&mut self, light: u64) {
        let mut lights = self.chosen_lights();
        if lights.contains(&light) {
            lights.retain(|chosen| *chosen != light);
        } else {
            lights.push(light);
        }
        self.choose_lights(&lights);
    }

    /// Chooses the lights from the primary one to `light`, in the order of the list `listed`.
    pub(super) fn choose_up_to(&mut self, light: u64, listed: &[u64]) {
        let place = |wanted: u64| listed.iter().position(|listed| *listed == wanted);
        let primary = match self.chosen {
            Chosen::Light(primary) if place(primary).is_some() => primary,
            _ => light,
        };
        let (Some(a), Some(b)) = (place(primary), place(light)) else { return };
        let others = listed[a.min(b)..=a.max(b)].iter().copied().filter(|id| *id != primary);
        self.other_lights = others.collect();
        self.chosen = Chosen::Light(primary);
    }
}

/// The position of a button's release, and the keys that were held then.
pub(super) fn released(event: &egui::Event) -> Option<(egui::Pos2, Modifiers)> {
    match *event {
        egui::Event::PointerButton { pos, pressed: false, modifiers, .. } => Some((pos, modifiers)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::demo::recent::Recent;

    #[test]
    fn lights_are_chosen_alone_together_and_up_to_another() {
        let mut ui_state = UiState::new("s", Recent::none());
        let listed = [4, 7, 1, 9];
        ui_state.choose(Chosen::Material(3));
        assert_eq!((ui_state.chosen_lights(), ui_state.edited_with(7)), (vec![], vec![7]));
        ui_state.choose_up_to(7, &listed);
        assert_eq!(ui_state.chosen_lights(), [7], "no light to begin with");
        ui_state.choose_up_to(9, &listed);
        assert_eq!(ui_state.chosen_lights(), [7, 1, 9]);
        ui_state.choose_up_to(4, &listed);
        assert_eq!(ui_state.chosen_lights(), [7, 4], "the primary one stays");
        ui_state.toggle_chosen(9);
        assert_eq!(ui_state.edited_with(4), [7, 4, 9]);
        assert_eq!(ui_state.edited_with(1), [1], "it is not chosen");
        ui_state.toggle_chosen(7);
        assert_eq!((ui_state.chosen, ui_state.chosen_lights()), (Chosen::Light(4), vec![4, 9]));
        ui_state.toggle_chosen(9);
        ui_state.toggle_chosen(4);
        assert_eq!(ui_state.chosen, Chosen::Nothing);
        ui_state.choose_lights(&[1, 4]);
        ui_state.choose(Chosen::Light(4));
        assert_eq!(ui_state.chosen_lights(), [4]);
    }
}
