//! Reference of the light-path energy scan: walks along each path.

use glam::DVec3;

/// Throughput of every vertex in path order. A step has a weight and the reflection of the vertex
/// before towards this one: π times its BRDF, or 1 if the flux of the path includes it. `None` if
/// a path starts.
pub fn path_scan(steps: impl IntoIterator<Item = (Option<DVec3>, f32)>) -> Vec<DVec3> {
    let mut throughput = DVec3::ONE;
    let mut throughputs = Vec::new();
    for (reflected, weight) in steps {
        throughput = f64::from(weight) * reflected.map_or(DVec3::ONE, |reflected| throughput * reflected);
        throughputs.push(throughput);
    }
    throughputs
}
