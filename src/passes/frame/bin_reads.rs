//! Lookup of gloss bins by cluster and direction: rays of glossy pixels reuse the outgoing flux
//! that gather rays read. In: gloss bins. Out: a list of direction bins for each cluster.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::passes::gather_targets::Reader;
use crate::passes::gloss_tables::GlossTables;
use crate::scene::directions::{Directions, resolved_exponent};
use glam::{UVec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Gloss bins by cluster and direction bin.
pub struct BinReads {
    /// CSR offsets into `reads`: one for each cluster, and the end.
    pub first: Buffer,
    /// (Direction bin, gloss bin), sorted for each cluster.
    pub reads: Buffer,
    /// The direction bins.
    pub directions: Directions,
    /// Exponent of the sharpest lobe whose gloss bins rays of pixels read: the bins would blur
    /// a sharper one.
    pub max_exponent: f32,
}

impl BinReads {
    /// Lists the gloss bins; `directions` are the bins for which they were made.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, tables: &GlossTables, directions: Directions) -> Result<Self> {
        let clusters = tables.base_ranges.len();
        let mut reads = Vec::with_capacity(tables.bins.len());
        for (index, gloss_bin) in (0..).zip(&tables.bins) {
            // A gloss bin without readers has no direction.
            if gloss_bin.direction != Vec3::ZERO {
                reads.push((gloss_bin.cluster, directions.bin(gloss_bin.direction.as_dvec3()), index));
            }
        }
        reads.sort_unstable();
        let first = |cluster: usize| reads.partition_point(|read| (read.0 as usize) < cluster) as u32;
        let first: Vec<u32> = (0..=clusters).map(first).collect();
        let reads: Vec<UVec2> = reads.iter().map(|&(_, bin, gloss_bin)| UVec2::new(bin, gloss_bin)).collect();
        Ok(Self {
            first: Buffer::from_slice(context, GrowsWith::Cells.named("first gloss bin reads"), &first)?,
            reads: Buffer::from_slice(context, GrowsWith::Cells.named("gloss bin reads"), &reads)?,
            directions,
            max_exponent: resolved_exponent(directions.count()),
        })
    }

    /// The gloss bins that rays read which meet these clusters and leave them in these direction
    /// bins: of each cluster the bin whose direction is next to it. Rays to clusters without any
    /// are left out.
    ///
    /// # Errors
    /// The device failed.
    pub fn readers(&self, wanted: &[(u32, (u32, u32))]) -> Result<Vec<Reader>> {
        let (first, reads): (Vec<u32>, Vec<UVec2>) = (self.first.read()?, self.reads.read()?);
        let find = |&(ray, (cluster, bin)): &(u32, (u32, u32))| {
            let known = &reads[first[cluster as usize] as usize..first[cluster as usize + 1] as usize];
            let index = match known.binary_search_by_key(&bin, |read| read.x) {
                Ok(place) => known[place].y,
                Err(_) => {
                    let direction = self.directions.middle(bin);
                    let cosine = |read: &&UVec2| direction.dot(self.directions.middle(read.x));
                    known.iter().max_by(|a, b| cosine(a).total_cmp(&cosine(b)))?.y
                }
            };
            Some(Reader { ray, index })
        };
        Ok(wanted.par_iter().filter_map(find).collect())
    }

    /// No gloss bins: rays of pixels use the vertices of all glossy surfaces.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn none(context: &Arc<Context>) -> Result<Self> {
        Ok(Self {
            first: Buffer::from_slice(context, GrowsWith::Cells.named("first gloss bin reads"), &[0_u32])?,
            reads: Buffer::from_slice(context, GrowsWith::Cells.named("gloss bin reads"), &[UVec2::ZERO])?,
            directions: Directions::new(1),
            max_exponent: 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::gloss_tables::GlossBin;

    #[test]
    fn a_ray_reads_the_bin_of_its_cluster_whose_direction_is_next() {
        let directions = Directions::new(64);
        let bin = |cluster, bin| GlossBin { cluster, direction: directions.middle(bin).as_vec3() };
        // Of the first cluster three bins, of the second none, of the third one without readers.
        let unread = GlossBin { cluster: 2, direction: Vec3::ZERO };
        let tables = GlossTables {
            bins: vec![bin(0, 40), bin(0, 3), unread, bin(0, 17)],
            base_ranges: vec![UVec2::ZERO; 3],
            ..GlossTables::default()
        };
        let context = Context::new(&crate::gpu::ContextOptions::default()).unwrap();
        let reads = BinReads::new(&context, &tables, directions).unwrap();
        let nearest = |wanted: u32| {
            let cosine = |bin: u32| directions.middle(wanted).dot(directions.middle(bin));
            [(40, 0), (3, 1), (17, 3)]
                .into_iter()
                .max_by(|a, b| cosine(a.0).total_cmp(&cosine(b.0)))
                .unwrap()
                .1
        };
        let wanted: Vec<(u32, (u32, u32))> = (0..64).map(|ray| (ray, (0, ray))).collect();
        let expected: Vec<Reader> = (0..64).map(|ray| Reader { ray, index: nearest(ray) }).collect();
        assert_eq!(reads.readers(&wanted).unwrap(), expected);
        assert_eq!((nearest(40), nearest(3), nearest(17)), (0, 1, 3));
        assert_eq!(reads.readers(&[(7, (1, 3)), (9, (2, 3))]).unwrap(), []);
    }
}
