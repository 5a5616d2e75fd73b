//! Names of the objects that triangles belong to.

use std::collections::HashMap;

/// Names in the order of their indices, each once.
#[derive(Default)]
pub(super) struct Objects {
    names: Vec<String>,
    /// For each name, the number that its last repetition has.
    numbers: HashMap<String, u32>,
}

impl Objects {
    /// Adds an object and returns its index. A name that is taken gets a number: `chair 2`.
    pub(super) fn add(&mut self, name: &str) -> u32 {
        let mut own = name.to_owned();
        while self.numbers.contains_key(&own) {
            let number = self.numbers.get_mut(name).expect("the name itself is taken");
            *number += 1;
            own = format!("{name} {number}");
        }
        self.numbers.insert(own.clone(), 1);
        self.names.push(own);
        self.names.len() as u32 - 1
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    pub(super) fn into_names(self) -> Vec<String> {
        self.names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_names_get_numbers_that_are_free() {
        let mut objects = Objects::default();
        let indices = ["chair", "chair 2", "chair", "", "chair", "chair 2"].map(|name| objects.add(name));
        assert_eq!((indices, objects.len()), ([0, 1, 2, 3, 4, 5], 6));
        assert_eq!(objects.into_names(), ["chair", "chair 2", "chair 3", "", "chair 4", "chair 2 2"]);
    }
}
