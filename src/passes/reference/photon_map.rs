//! Photon map: photons in the order of the buckets of their cells. [Jensen 1996] In:
//! slots of photons, some of them empty. Out: map entries, and the first entry of
//! each bucket. Deterministic.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::passes::reference::tile_sort::TileSort;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A photon that arrived at a surface.
    pub struct Photon {
        /// Position of the photon, metres.
        pub position: Vec3,
        /// 2·triangle + (1 if the back side); [`NO_SIDE`](crate::types::NO_SIDE) if the
        /// slot is empty.
        pub side: u32,
        /// Flux of the photon, W.
        pub flux: Vec3,
    }
}

gpu_struct! {
    /// An entry of a map.
    pub struct MapEntry {
        /// Position of the photon, metres.
        pub position: Vec3,
        /// Unit geometric normal of its side.
        pub normal: Vec3,
        /// Flux of the photon, W.
        pub flux: Vec3,
    }
}

gpu_struct! {
    /// The cells of a map: cubes as wide as the radius of the density estimate.
    pub struct PhotonGrid {
        /// A corner of cell (0, 0, 0).
        pub low: Vec3,
        /// 1 / edge of a cell, 1/m.
        pub inverse_cell: f32,
    }
}

gpu_struct! {
    /// Push constants of the first step.
    pub struct PhotonCellsPush {
        pub grid: PhotonGrid,
        /// Number of slots, including empty ones.
        pub slot_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the last step.
    pub struct PhotonOrderPush {
        /// Number of slots, including empty ones.
        pub slot_count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] =
    &[Photon::LAYOUT, MapEntry::LAYOUT, PhotonGrid::LAYOUT, PhotonCellsPush::LAYOUT, PhotonOrderPush::LAYOUT];

/// Stem of shaders, reference and timing.
pub const STEM: &str = "photon_map";

/// Number of buckets of the cells' hash; one more takes the empty slots, so that a bucket's index
/// has 16 bits.
pub const BUCKETS: u32 = u16::MAX as u32;

/// A map's pipelines and buffers.
pub struct PhotonMap {
    cells: Pipeline,
    order: Pipeline,
    sort: TileSort,
    slot_count: Buffer,
    capacity: u32,
    /// The unsorted `Photon`s, as traced.
    pub slots: Buffer,
    /// The `MapEntry`s, sorted by bucket.
    pub entries: Buffer,
    /// First entry of each bucket, then twice the end.
    pub entry_offsets: Buffer,
}

impl PhotonMap {
    /// Allocates `capacity` slots, including empty ones.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, capacity: u32) -> Result<Self> {
        let storage =
            |name, element: usize| Buffer::storage(context, name, u64::from(capacity) * element as u64);
        Ok(Self {
            cells: Pipeline::new(context, "photon_cells", &[])?,
            order: Pipeline::new(context, "photon_order", &[])?,
            sort: TileSort::new(context, capacity)?,
            slot_count: Buffer::storage(context, "slot count", 4)?,
            capacity,
            slots: storage("photons", size_of::<Photon>())?,
            entries: storage("map entries", size_of::<MapEntry>())?,
            entry_offsets: Buffer::storage(context, "entry offsets", 4 * (u64::from(BUCKETS) + 2))?,
        })
    }

    /// Number of its slots.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Sorts the first `count` slots. Returns the device time in milliseconds.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn build(
        &self,
        context: &Arc<Context>,
        scene: &SceneBuffers,
        grid: PhotonGrid,
        count: u32,
    ) -> Result<f64> {
        self.slot_count.write(&[count])?;
        let ((), timings) = context.run(|rec| self.record(rec, scene, grid, count))?;
        Ok(timings[0].ms)
    }

    fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, grid: PhotonGrid, count: u32) {
        let mut pass = rec.pass(STEM);
        pass.dispatch(
            &self.cells,
            [count.max(1), 1, 1],
            &PhotonCellsPush { grid, slot_count: count },
            &[("Photons", &self.slots), ("Pairs", self.sort.input())],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        let sorted = self.sort.record(&mut pass, &self.slot_count, 0, BUCKETS + 1);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.order,
            [count.max(BUCKETS + 2), 1, 1],
            &PhotonOrderPush { slot_count: count },
            &[
                ("Surfaces", &scene.surfaces),
                ("Photons", &self.slots),
                ("SortedPairs", sorted),
                ("MapEntries", &self.entries),
                ("EntryOffsets", &self.entry_offsets),
            ],
        );
    }
}
