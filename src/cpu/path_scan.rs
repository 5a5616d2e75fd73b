//! Twin of the light-path energy scan: walks along each path.

use glam::DVec3;

/// Throughput of every vertex in path order. A step is the albedo of the material that reflected the path towards the
/// vertex, none where a path starts, and the weight of having survived, or of the path itself where it starts.
pub fn path_scan(steps: impl IntoIterator<Item = (Option<DVec3>, f32)>) -> Vec<DVec3> {
    let mut throughput = DVec3::ONE;
    let mut throughputs = Vec::new();
    for (albedo, weight) in steps {
        throughput = f64::from(weight) * albedo.map_or(DVec3::ONE, |albedo| throughput * albedo);
        throughputs.push(throughput);
    }
    throughputs
}
