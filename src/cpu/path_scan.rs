//! Reference of the light-path energy scan: walks along each path.

use glam::DVec3;

/// Throughput of every vertex in path order. A step is what the vertex before reflects towards this
/// one (π times its BRDF; all, where the flux of the path has that already), none where a path
/// starts; and its weight.
pub fn path_scan(steps: impl IntoIterator<Item = (Option<DVec3>, f32)>) -> Vec<DVec3> {
    let mut throughput = DVec3::ONE;
    let mut throughputs = Vec::new();
    for (reflected, weight) in steps {
        throughput = f64::from(weight) * reflected.map_or(DVec3::ONE, |reflected| throughput * reflected);
        throughputs.push(throughput);
    }
    throughputs
}
