//! Twin of the volumetric hierarchy of a frame.

use crate::scene::hvds::Hvds;
use crate::types::Deposit;
use glam::{DVec3, Vec3};

/// Flux of every cluster, W, [direct, indirect]: of a base cluster the sum of its deposits, of a coarser one the sum of all base clusters below it.
pub fn cluster_flux(
    hvds: &Hvds,
    path_flux: &[Vec3],
    first_deposits: &[u32],
    deposits: &[Deposit],
) -> Vec<[DVec3; 2]> {
    let mut flux = vec![[DVec3::ZERO; 2]; hvds.cluster_count() as usize];
    for (list, run) in first_deposits.windows(2).enumerate() {
        let own: DVec3 = deposits[run[0] as usize..run[1] as usize]
            .iter()
            .map(|deposit| deposit.throughput.as_dvec3() * path_flux[deposit.path as usize].as_dvec3())
            .sum();
        let mut cluster = list / 2;
        while let Some(sum) = flux.get_mut(cluster) {
            sum[list % 2] += own;
            cluster = hvds.parents[cluster] as usize;
        }
    }
    flux
}
