//! Tuned values change the order of sums and nothing else.

use crate::common::{assert_silent, context};
use crate::{FEW, the_box};
use lightpaths::gpu::{CHOICES, Context, ContextOptions, Tuning, TuningChange};
use lightpaths::metrics::relmse;
use lightpaths::renderer::{Layer, Renderer, Silent, Work};
use std::sync::Arc;

/// Bound of the relMSE of indirect light. A sum of a hundred terms in another order differs by at
/// most 100·2⁻²⁴ of it, whose square is 4·10⁻¹¹.
const ORDER_OF_SUMS: f64 = 1e-10;

fn render(context: &Arc<Context>) -> [Vec<[f32; 3]>; 2] {
    let mut scene = the_box(&[]);
    scene.quality = FEW;
    let mut renderer = Renderer::new(context, scene, &mut Silent).unwrap();
    renderer.frame().unwrap();
    renderer.force(Work::Light(0));
    renderer.frame().unwrap();
    assert_silent(context);
    [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap())
}

/// Compares pictures with each list of changes with the class's picture.
fn pictures_are_the_same(lists: impl IntoIterator<Item = Vec<TuningChange>>) {
    let [direct, indirect] = render(&context());
    assert!(indirect.iter().flatten().sum::<f32>() > 0.0);
    for tuning in lists {
        let text: Vec<String> = tuning.iter().map(TuningChange::to_string).collect();
        let options =
            ContextOptions { validation: true, hazard_check: true, tuning, ..ContextOptions::default() };
        let found = render(&Context::new(&options).unwrap());
        let bits = |layer: &[[f32; 3]]| layer.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert!(bits(&found[0]) == bits(&direct), "{text:?}: direct light");
        let error = relmse(&found[1], &indirect);
        println!("{text:?}: relMSE {error:.1e}");
        assert!(error < ORDER_OF_SUMS, "{text:?}: {error:e}");
        if text.iter().all(|change| change.starts_with("finds_alike") || change.starts_with("shafts")) {
            assert!(bits(&found[1]) == bits(&indirect), "{text:?}: indirect light");
        }
    }
}

/// All values of a GPU, on whatever device there is.
fn values_of_a_gpu() -> Vec<TuningChange> {
    let limits = lightpaths::gpu::Limits { workgroup_count: [65_535; 3], ..*context().limits() };
    let gpu = Tuning::from_device("discrete GPU", &limits, 1);
    CHOICES.iter().map(|choice| choice.change(choice.value(&gpu))).collect()
}

/// Each value occurs in a list: list k has the k-th value of each choice.
#[test]
fn lists_with_every_value_give_the_same_picture() {
    let limits = *context().limits();
    let allowed = CHOICES.each_ref().map(|choice| (choice, choice.allowed(&limits)));
    let count = allowed.iter().map(|(_, values)| values.len()).max().unwrap();
    let list = |k: usize| -> Vec<TuningChange> {
        let change = |choice: &'static lightpaths::gpu::Choice, values: &[u32]| {
            choice.change(values[k % values.len()])
        };
        allowed.iter().map(|(choice, values)| change(choice, values)).collect()
    };
    pictures_are_the_same((0..count).map(list).chain([values_of_a_gpu()]));
}

#[test]
#[ignore = "takes a minute: make stress"]
fn every_value_alone_gives_the_same_picture() {
    let limits = *context().limits();
    let alone = |choice: &'static lightpaths::gpu::Choice| {
        choice.allowed(&limits).into_iter().map(move |value| vec![choice.change(value)])
    };
    pictures_are_the_same(CHOICES.iter().flat_map(alone));
}
