//! Queries about a point, compared with the results of frames.

use crate::common::{assert_silent, context};
use glam::Vec3;
use lightpaths::renderer::{Layer, PathPoint, Renderer, Silent};
use lightpaths::scene::{LoadOptions, Quality, Scene};
use lightpaths::types::{CachePoint, Contribution, ContributionRange, MergedRay, Record};
use std::collections::BTreeMap;

const SMALL: Quality = Quality {
    preset: "test",
    entry_points: 20_000,
    cache_points: 1_500,
    gather_rays: 64,
    cells: 16,
    ..Quality::DRAFT
};

/// The built-in Box, 64×48 pixels.
fn the_box() -> Scene {
    let set = vec!["camera.size=[64,48]".to_owned()];
    let mut scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    scene.quality = SMALL;
    scene
}

/// With an editable glossy teapot, so that paths are stored in another order than they were traced.
fn glossy_box() -> Scene {
    let mut scene = the_box();
    let teapot = scene.materials.iter_mut().find(|material| material.name == "teapot").unwrap();
    (teapot.editable, teapot.specular, teapot.exponent) = (true, Vec3::splat(0.3), 20.0);
    teapot.diffuse *= 0.5;
    scene
}

fn prepare(scene: Scene) -> Renderer {
    Renderer::new(&context(), scene, &mut Silent).unwrap()
}

/// A renderer after its first frames: all records are current.
fn render(scene: Scene) -> Renderer {
    let mut renderer = prepare(scene);
    (0..2).for_each(|_| drop(renderer.frame().unwrap()));
    renderer
}

fn pixels() -> impl Iterator<Item = [u32; 2]> {
    (0..48).flat_map(|y| (0..64).map(move |x| [x, y]))
}

#[test]
fn a_pixel_tells_its_surface_and_its_records() {
    let mut renderer = prepare(the_box());
    assert_eq!(renderer.surface_at([32, 24]).unwrap(), None, "there is no picture yet");
    assert!(renderer.records_at([32, 24]).unwrap().is_empty());
    renderer.frame().unwrap();
    let [normals, depths, albedos] =
        [Layer::Normal, Layer::Depth, Layer::Albedo].map(|layer| renderer.layer(layer).unwrap());
    let points: Vec<CachePoint> = renderer.stages().cache_points.read().unwrap();
    let scene = renderer.scene();
    let (mut seen, mut covered) = (0, 0);
    for (index, pixel) in pixels().enumerate() {
        let found = renderer.surface_at(pixel).unwrap();
        assert_eq!(found.is_some(), depths[index][0].is_finite());
        let records = renderer.records_at(pixel).unwrap();
        let Some(found) = found else {
            assert!(records.is_empty());
            continue;
        };
        seen += 1;
        assert_eq!((found.depth_m, found.normal.to_array()), (depths[index][0], normals[index]));
        assert_eq!(scene.materials[found.material].diffuse.to_array(), albedos[index]);
        let triangle = &scene.triangles[found.triangle as usize];
        assert_eq!(triangle.material as usize, found.material);
        let plane = triangle.geometric_normal();
        assert!((found.position - triangle.positions[0]).dot(plane).abs() < 1e-4);
        assert_eq!(found.is_back, plane.dot(found.normal) < 0.0);

        let sum: f32 = records.iter().map(|record| record.fraction).sum();
        assert!((sum - 1.0).abs() < 1e-5 && records.iter().all(|record| record.fraction >= 0.0));
        let is_near = |record: u32| {
            let point = &points[record as usize];
            point.position.distance(found.position) <= point.radius && point.normal.dot(found.normal) > 0.0
        };
        covered += u32::from(records.iter().all(|record| is_near(record.record)));
    }
    assert!(seen > 1_000 && covered * 10 > seen * 9, "{covered} of {seen} pixels");
    assert_eq!(renderer.surface_at([64, 0]).unwrap(), None);
    assert_eq!(renderer.surface_at([0, 48]).unwrap(), None);
    for (index, point) in (0..).zip(&points).step_by(97) {
        let nearest = renderer.nearest_cache_point(point.position, point.normal).unwrap();
        assert_eq!(nearest, Some(index));
    }
    renderer.resize([32, 24]).unwrap();
    assert_eq!(renderer.surface_at([16, 12]).unwrap(), None, "there is no picture of this size");
    assert_silent(&context());
}

/// Number of rays of a point that read each gather target.
fn stored(renderer: &Renderer, point: u32) -> BTreeMap<u32, u32> {
    let merged_rays = renderer.stages().merged_rays;
    let chunk = merged_rays.chunks.iter().find(|chunk| chunk.points.contains(&point)).unwrap();
    let first: Vec<u32> = chunk.merged_ray_offsets.read().unwrap();
    let row = (point - chunk.points.start) as usize;
    let list: Vec<MergedRay> = chunk.merged_rays.read().unwrap();
    let mut counts = BTreeMap::new();
    for merged_ray in &list[first[row] as usize..first[row + 1] as usize] {
        let [count, target_index] = [
            merged_ray.target_index >> merged_rays.target_bits,
            merged_ray.target_index % (1 << merged_rays.target_bits),
        ];
        *counts.entry(target_index).or_insert(0) += count + 1;
    }
    counts
}

/// If rays read only clusters, the clusters of rays that are traced again equal those of
/// the merged rays.
#[test]
fn gather_rays_meet_the_clusters_that_merged_rays_name() {
    let mut scene = the_box();
    (scene.quality.occlusion, scene.quality.gap_rounds) = (false, 0);
    let renderer = render(scene);
    let targets: Vec<u32> = renderer.stages().merged_rays.targets.read().unwrap();
    let (mut rays, mut apart, mut hits) = (0, 0, 0);
    for point in (0..1_000).step_by(83) {
        let segments = renderer.gather_rays_of(point).unwrap();
        let mut counts = BTreeMap::new();
        for segment in &segments {
            hits += usize::from(segment.hit.is_some());
            if let Some(target_index) = segment.target_index {
                *counts.entry(target_index).or_insert(0) += 1;
                // A target is a cluster and, in the bits above, a material.
                let cluster = segment.cluster.unwrap();
                assert_eq!((targets[target_index as usize] ^ cluster).trailing_zeros().min(12), 12);
            }
            assert!(segment.cluster.is_none() || segment.hit.is_some());
            assert!((segment.direction.length() - 1.0).abs() < 1e-5);
        }
        let stored = stored(&renderer, point);
        rays += stored.values().sum::<u32>();
        let missing = stored
            .iter()
            .map(|(target_index, &count)| count - counts.get(target_index).copied().unwrap_or(0).min(count));
        apart += missing.sum::<u32>();
    }
    println!("{apart} of {rays} rays meet something else");
    // Rays on an edge of a triangle or a cell may differ.
    assert!(rays > 500 && apart * 500 <= rays && hits > 500, "{apart} of {rays}");
    assert!(renderer.gather_rays_of(u32::MAX).unwrap().is_empty());
    assert_silent(&context());
}

/// With patches and gloss bins in place of clusters, the irradiance of a record is still the sum
/// over its rays.
#[test]
fn gather_rays_bring_what_records_gathered() {
    // Fine settings: some surfaces are near cache points.
    let quality = Quality { entry_points: 60_000, cells: 64, gap_rounds: 2, ..SMALL };
    for (what, mut scene) in [("diffuse", the_box()), ("glossy", glossy_box())] {
        scene.quality = quality.clone();
        let renderer = render(scene);
        let counts = renderer.statistics().unwrap().counts;
        let readers = counts["gather rays that read near patches"];
        println!("{what}: {readers} rays read patches");
        assert!(readers > 50);
        let emission_scale = renderer.stages().emission_scale;
        let records: Vec<Record> = renderer.stages().gathered.read().unwrap();
        let (mut rays, mut apart, mut unread) = (0, 0, 0);
        let (mut sum, mut error) = (Vec3::ZERO, Vec3::ZERO);
        for point in (0..records.len() as u32).step_by(37) {
            let segments = renderer.gather_rays_of(point).unwrap();
            let expected = emission_scale * records[point as usize].irradiance;
            let radiance: Vec3 = segments.iter().map(|segment| segment.radiance).sum();
            let found = radiance * (std::f32::consts::PI / 64.0);
            sum += expected;
            error += (found - expected).abs();
            unread += segments
                .iter()
                .filter(|found| found.cluster.is_some() && found.target_index.is_none())
                .count();
            let mut left = stored(&renderer, point);
            rays += left.values().sum::<u32>();
            for target_index in segments.iter().filter_map(|segment| segment.target_index) {
                left.entry(target_index).and_modify(|count| *count = count.saturating_sub(1));
            }
            apart += left.values().sum::<u32>();
        }
        println!("{what}: {apart} of {rays} rays read something else, {unread} nothing; {error} of {sum}");
        assert!(sum.min_element() > 0.0 && error.max_element() < 3e-3 * sum.max_element());
        assert!(rays > 1_000 && apart * 50 <= rays && unread as u32 * 500 <= rays);
    }
    assert_silent(&context());
}

/// Clusters of a path's contributions, with the contributions, in a fixed order.
fn contributed(
    contributions: &[Contribution],
    runs: &[ContributionRange],
    path: u32,
) -> Vec<(u32, [u32; 3])> {
    let mut found = Vec::new();
    for (cluster, run) in (0..).zip(runs).filter(|(_, run)| run.is_unweighted == 0) {
        let own = &contributions[run.first as usize..run.end as usize];
        let of_path = own.iter().filter(|contribution| contribution.path() == path);
        found.extend(of_path.map(|contribution| (cluster, bits(contribution.throughput))));
    }
    found.sort_unstable();
    found
}

fn bits(value: Vec3) -> [u32; 3] {
    value.to_array().map(f32::to_bits)
}

#[test]
fn paths_traced_again_lie_where_their_contributions_went() {
    for (what, scene) in [("diffuse", the_box()), ("glossy", glossy_box())] {
        let mut renderer = render(scene);
        // A material that is not editable had another albedo when the paths were traced.
        renderer.set_diffuse(0, Vec3::new(0.2, 0.3, 0.1)).unwrap();
        renderer.frame().unwrap();
        let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
        let runs: Vec<ContributionRange> = renderer.stages().contribution_ranges.read().unwrap();
        let mut vertices = 0;
        for path in (11..20_000).step_by(1_777) {
            let points: Vec<PathPoint> = renderer.light_path_of(path).unwrap();
            vertices += points.len();
            let held = points.iter().filter_map(|point| Some((point.cluster?, bits(point.throughput))));
            let mut held: Vec<_> = held.collect();
            held.sort_unstable();
            assert_eq!(held, contributed(&contributions, &runs, path), "{what}, path {path}");
            let nearest = renderer.entry_point_near(points[0].position).unwrap().unwrap();
            let again = renderer.light_path_of(nearest).unwrap()[0];
            assert_eq!(again.position, points[0].position);
            for pair in points.windows(2) {
                let way = pair[1].position - pair[0].position;
                assert!(way.dot(pair[0].normal) > -1e-5 && way.dot(pair[1].normal) < 1e-5);
            }
        }
        assert!(vertices > 24, "{what}: {vertices} vertices");
        assert!(renderer.light_path_of(u32::MAX).unwrap().is_empty());
    }
    assert_silent(&context());
}

#[test]
fn levels_of_clusters_nest_under_the_picture() {
    let mut renderer = prepare(the_box());
    assert!(renderer.cluster_colours(0).unwrap().iter().all(Option::is_none), "there is no picture yet");
    renderer.frame().unwrap();
    let picture = renderer.layer(Layer::Beauty).unwrap();
    let levels = renderer.hvds_level_count();
    let of_levels: Vec<_> = (0..levels).map(|level| renderer.cluster_colours(level).unwrap()).collect();
    renderer.set_exposure(1.0);
    renderer.frame().unwrap();
    assert!(renderer.layer(Layer::Beauty).unwrap() == picture, "nothing was changed by it");

    let surfaces: Vec<_> = pixels().map(|pixel| renderer.surface_at(pixel).unwrap()).collect();
    let mut count_before = usize::MAX;
    for (level, clusters) in (0..).zip(&of_levels) {
        let mut boxes: BTreeMap<u32, (Vec3, Vec3)> = BTreeMap::new();
        for (surface, cluster) in surfaces.iter().zip(clusters) {
            assert_eq!(surface.is_some(), cluster.is_some());
            let (Some(surface), Some(cluster)) = (surface, cluster) else { continue };
            let point = surface.position;
            let found = boxes.entry(cluster.cluster).or_insert((point, point));
            *found = (found.0.min(point), found.1.max(point));
            assert!(cluster.irradiance.is_finite() && cluster.irradiance.min_element() >= 0.0);
        }
        let cell = renderer.hvds_cell_size_m(level) as f32;
        let widest = boxes.values().map(|(low, high)| (high - low).max_element()).fold(0.0, f32::max);
        assert!(widest <= 1.01 * cell, "level {level}: {widest} m in cells of {cell} m");
        assert!(boxes.len() <= count_before && boxes.len() > 1);
        count_before = boxes.len();
    }
    // One for each normal code of the surfaces.
    assert!(count_before <= 52, "{count_before} clusters at the root");
    assert_eq!(renderer.cluster_colours(u32::MAX).unwrap(), of_levels[levels as usize - 1]);
    // Clusters that nothing reads are as current as without skipping.
    renderer.set_skipping(false);
    renderer.frame().unwrap();
    let irradiance: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
    let emission_scale = renderer.stages().emission_scale;
    for found in of_levels.iter().flatten().flatten() {
        assert_eq!(bits(found.irradiance), bits(emission_scale * irradiance[found.cluster as usize]));
    }
    assert_silent(&context());
}
