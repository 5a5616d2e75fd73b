//! What is dirty: edits since the last frame, and cached results that they made stale. All state
//! that can be stale stands here; [`FramePlan`] follows from it.

use super::plan::{FramePlan, Gathering, LightResults, Scan, Uploads};
use crate::passes::frame::needed_records::RecordRequest;

/// Work that a caller can request without a change, to measure its cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// All work of a frame.
    Everything,
    /// The work after the light with this index has moved.
    Light(usize),
    /// The work after a light's colour has changed.
    Colour,
    /// The work after the camera has moved.
    View,
    /// The work after a material has changed.
    Material,
}

/// Edits since the last frame that concern no single light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Changes {
    pub(super) view: bool,
    /// The size of the picture: its buffers are empty, even if no light is active.
    pub(super) size: bool,
    /// Emission of lights: their colours, or the set of active lights.
    pub(super) emission: bool,
    /// Emission of the only active light, or the weights of direct and indirect light.
    pub(super) composition: bool,
    /// Paths whose flux has changed, because edited materials reflect them.
    pub(super) scan: Scan,
    /// The set of glossy materials, or the exponent of one.
    pub(super) lobes: bool,
    /// How radiance is displayed.
    pub(super) display_transform: bool,
}

impl Changes {
    const ALL: Self = Self {
        view: true,
        size: true,
        emission: true,
        composition: true,
        scan: Scan::All,
        lobes: true,
        display_transform: true,
    };
}

/// What is dirty.
#[derive(Clone, Debug)]
pub(super) struct Dirty {
    pub(super) changes: Changes,
    pub(super) uploads: Uploads,
    /// Stale results of each light.
    pub(super) lights: Vec<LightResults>,
    /// The boxes around tiles of pixels are stale.
    pub(super) pixel_batches: bool,
    pub(super) records: RecordState,
    /// Frames skip work whose inputs have not changed.
    pub(super) skips: bool,
}

/// The state of the records and of their list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecordState {
    /// The mask of seen records is current for the view.
    knows_view: bool,
    /// The list holds every record that the view uses.
    has_list: bool,
    /// Some records may be stale.
    lags: bool,
    /// Number of records in the last frame that gathered any, records gathered ahead included.
    pub(super) gathered: u32,
    /// The last list was built for a new view, so that its pass read the splat weights.
    pub(super) marked_view: bool,
}

impl Dirty {
    /// Everything is dirty.
    pub(super) fn new(light_count: usize) -> Self {
        Self {
            changes: Changes::ALL,
            uploads: Uploads { lights: true, emission: true, materials: false },
            lights: vec![LightResults::ALL; light_count],
            pixel_batches: true,
            records: RecordState::default(),
            skips: true,
        }
    }

    /// Marks all results of a light stale.
    pub(super) fn light_moved(&mut self, light: usize) {
        self.lights[light] = LightResults { cleared: self.lights[light].cleared, ..LightResults::ALL };
    }

    /// Marks results stale that depend on the points that the camera sees.
    pub(super) fn view_changed(&mut self) {
        self.changes.view = true;
        self.pixel_batches = true;
        for light in &mut self.lights {
            (light.irradiance, light.hits, light.highlights) = (true, true, true);
        }
    }

    /// Marks hits and highlights stale: the lobe of a material has changed.
    pub(super) fn lobes_changed(&mut self) {
        self.changes.lobes = true;
        self.lights.iter_mut().for_each(|light| (light.hits, light.highlights) = (true, true));
    }

    /// Marks results stale that depend on the flux of light paths and on the reflectance at their
    /// vertices. `bit` stands for the edited material; `None` if all paths may be affected.
    pub(super) fn material_changed(&mut self, bit: Option<u32>) {
        self.changes.scan = match (self.changes.scan, bit) {
            (Scan::None, Some(bit)) => Scan::Materials(bit),
            (Scan::Materials(bits), Some(bit)) => Scan::Materials(bits | bit),
            _ => Scan::All,
        };
        self.lights.iter_mut().for_each(|light| (light.clusters, light.hits) = (true, true));
    }

    /// Marks the flux of clusters stale: frames compute more of them than before.
    pub(super) fn live_set_changed(&mut self) {
        self.changes.emission = true;
        self.lights.iter_mut().for_each(|light| light.clusters = true);
    }

    /// Marks work and uploads dirty without a change. `is_single` if one light is active.
    pub(super) fn force(&mut self, work: Work, is_single: bool) {
        match work {
            Work::Everything => {
                self.changes = Changes { size: self.changes.size, ..Changes::ALL };
                (0..self.lights.len()).for_each(|light| self.light_moved(light));
                self.pixel_batches = true;
                (self.uploads.lights, self.uploads.materials) = (true, true);
            }
            Work::Light(light) => {
                self.light_moved(light);
                self.uploads.lights = true;
            }
            Work::Colour if is_single => self.changes.composition = true,
            Work::Colour => self.changes.emission = true,
            Work::View => self.view_changed(),
            Work::Material => {
                self.material_changed(None);
                self.uploads.materials = true;
            }
        }
    }

    /// The plan of the next frame. `traced` marks the lights that frames trace and sum; `is_glossy`
    /// if some material is or may become glossy.
    pub(super) fn plan(&self, traced: &[bool], is_glossy: bool) -> FramePlan {
        let lights: Vec<LightResults> = self
            .lights
            .iter()
            .zip(traced)
            .map(|(stale, is_traced)| stale.of(*is_traced, is_glossy))
            .collect();
        let any = |result: fn(&LightResults) -> bool| lights.iter().any(result);
        let changes = self.changes;
        let direct_sum = changes.emission || changes.size || any(|light| light.irradiance);
        let hierarchy = changes.emission || any(|light| light.factors) || changes.scan != Scan::None;
        let splat = hierarchy || changes.view;
        let lobe_rays = changes.view || changes.lobes;
        let gloss = splat || direct_sum || lobe_rays;
        let compose = gloss || changes.composition;
        let display = compose || changes.display_transform;
        let mut plan = FramePlan {
            // Sums take colours as push constants. Only kernels that trace to a light read the
            // table.
            uploads: Uploads {
                lights: self.uploads.lights
                    && any(|light| light.factors || light.irradiance || light.highlights),
                ..self.uploads
            },
            view: changes.view,
            lobe_rays: lobe_rays && is_glossy,
            pixel_batches: self.pixel_batches && any(|light| light.irradiance),
            direct_sum,
            scan: changes.scan,
            hierarchy,
            is_whole: !self.skips,
            gather: Gathering::Nothing,
            splat,
            gloss: gloss && is_glossy,
            compose,
            display,
            lights,
        };
        plan.gather = self.records.gathering(&plan);
        plan
    }

    /// Marks clean what a frame with this plan computes.
    pub(super) fn clean(&mut self, plan: &FramePlan, traced: &[bool]) {
        self.changes = Changes::default();
        self.uploads.lights &= !plan.uploads.lights;
        self.uploads.emission &= !plan.uploads.emission;
        self.uploads.materials &= !plan.uploads.materials;
        self.pixel_batches &= !plan.pixel_batches;
        for (stale, _) in self.lights.iter_mut().zip(traced).filter(|(_, is_traced)| **is_traced) {
            *stale = LightResults::default();
        }
        self.records.clean(plan);
    }
}

impl RecordState {
    /// The records that a frame gathers:
    ///
    /// - after a light edit, the records that the view uses;
    /// - after a camera movement, further records that the new view uses;
    /// - once, in a frame without a change, all others: records are then current for any camera.
    pub(super) fn gathering(&self, plan: &FramePlan) -> Gathering {
        let request = RecordRequest {
            view_is_new: plan.view || !self.knows_view,
            none_is_current: plan.hierarchy,
            all: false,
        };
        match plan.hierarchy {
            true if plan.is_whole => Gathering::All,
            true if self.has_list && !request.view_is_new => Gathering::Listed,
            true => Gathering::List(request),
            false if !self.lags => Gathering::Nothing,
            false if plan.view => Gathering::List(request),
            false if plan.is_idle() => {
                Gathering::List(RecordRequest { view_is_new: false, all: true, ..request })
            }
            false => Gathering::Nothing,
        }
    }

    fn clean(&mut self, plan: &FramePlan) {
        self.knows_view &= !plan.view;
        self.has_list &= !plan.view;
        match plan.gather {
            Gathering::Nothing => {}
            Gathering::All => (self.has_list, self.lags) = (false, false),
            Gathering::Listed => self.lags = true,
            Gathering::List(request) => {
                self.marked_view = request.view_is_new;
                self.knows_view |= request.view_is_new;
                self.has_list = request.none_is_current;
                self.lags = !request.all;
            }
        }
    }

    /// Takes over the length of a frame's list, out of `record_count` records. Frames end in order.
    /// `is_last`: no later one is recorded. Returns the number of records that the frame gathered.
    pub(super) fn count(&mut self, plan: &FramePlan, listed: u32, record_count: u32, is_last: bool) -> u32 {
        self.gathered = match plan.gather {
            Gathering::Nothing => return 0,
            Gathering::All => record_count,
            Gathering::Listed => self.gathered,
            Gathering::List(_) => listed,
        };
        // A later frame may have made records stale again.
        if is_last && self.gathered == record_count {
            self.lags = false;
        }
        self.gathered
    }

    /// Number of records that the view uses. `None` if the list does not hold them.
    pub(super) fn of_view(&self) -> Option<u32> {
        self.has_list.then_some(self.gathered)
    }
}
