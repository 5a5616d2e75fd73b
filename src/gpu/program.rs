//! Programs: compute shaders with a value for each specialisation constant, and their Vulkan
//! objects, which the driver compiles at the first use.

use std::sync::{Arc, PoisonError, RwLock};

use ash::vk;

use super::device::Limits;
use super::names::Names;
use super::optional::Optional;
use super::shaders::Shader;
use super::spirv::{self, Binding, FROM_BINDINGS, Module, dead_branches};
use super::{Tuning, VkResultExt};
use crate::error::{Error, Result};

/// A specialised shader and, from its first use on, the Vulkan objects for it.
pub(super) struct Program {
    pub(super) stem: &'static str,
    pub(super) module: Module,
    /// All constants except [`FROM_BINDINGS`].
    constants: Vec<(String, u32)>,
    /// The Vulkan objects of each variant, by [`Variant::index`]. `None` before the first use.
    variants: [RwLock<Option<Arc<Handles>>>; Variant::COUNT],
}

/// Values of the constants that follow from the bindings, in the order of [`FROM_BINDINGS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Variant(pub(super) [bool; FROM_BINDINGS.len()]);

impl Variant {
    const COUNT: usize = 1 << FROM_BINDINGS.len();

    pub(super) fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).map(|index| Self(std::array::from_fn(|bit| index >> bit & 1 == 1)))
    }

    fn index(self) -> usize {
        self.0.iter().enumerate().map(|(bit, &is_set)| usize::from(is_set) << bit).sum()
    }
}

/// The Vulkan objects of a program. Recordings share them.
/// [`Pipelines`](super::pipelines::Pipelines) destroys them.
#[derive(Clone, Copy)]
pub(super) struct Handles {
    pub(super) pipeline: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
}

/// Inputs for the creation of [`Handles`]; threads share it.
#[derive(Clone, Copy)]
pub(super) struct Maker<'a> {
    pub(super) device: &'a ash::Device,
    pub(super) names: &'a Names,
    pub(super) optional: &'a Optional,
    pub(super) cache: vk::PipelineCache,
}

impl Program {
    /// Creates the program. Panics if a constant is missing or unknown.
    pub(super) fn new(
        shader: &Shader,
        constants: &[(&str, u32)],
        tuning: &Tuning,
        limits: &Limits,
    ) -> Result<Self> {
        let (stem, mut module) = (shader.stem, spirv::reflect(&shader.words()));
        let knows = |name: &str| module.constants.iter().any(|constant| constant.name == name);
        let is_given = |name: &str| constants.iter().any(|(given, _)| *given == name);
        let tuned = tuning.constants().into_iter().filter(|(name, _)| knows(name) && !is_given(name));
        let constants: Vec<_> = constants.iter().copied().chain(tuned).collect();
        for (size, name) in module.local_size.iter_mut().zip(spirv::LOCAL_SIZE) {
            *size = constants.iter().find(|(given, _)| *given == name).map_or(*size, |(_, value)| *value);
        }
        check_limits(stem, &module, limits)?;
        // Checked here and not at the first use, so that a mistake shows where the
        // pipeline is created.
        specialisation(stem, &module, &constants, Variant::default());
        let constants = constants.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        Ok(Self { stem, module, constants, variants: Default::default() })
    }

    /// The Vulkan objects of a variant. `None` before [`Self::make`].
    pub(super) fn handles(&self, variant: Variant) -> Option<Arc<Handles>> {
        self.variants[variant.index()].read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Creates the Vulkan objects of a variant that has none, from the program's shader.
    pub(super) fn make(&self, maker: Maker<'_>, shader: &Shader, variant: Variant) -> Result<()> {
        let handles = self.compile(maker, shader, variant)?;
        let mut made = self.variants[variant.index()].write().unwrap_or_else(PoisonError::into_inner);
        match &*made {
            // Another thread was faster; its objects are in use.
            Some(_) => handles.destroy(maker.device),
            None => *made = Some(Arc::new(handles)),
        }
        Ok(())
    }

    /// Creates the Vulkan objects of a variant. The caller owns them.
    pub(super) fn compile(&self, maker: Maker<'_>, shader: &Shader, variant: Variant) -> Result<Handles> {
        let constants: Vec<_> = self.constants.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let constants = specialisation(self.stem, &self.module, &constants, variant);
        Handles::new(maker, shader, &self.module, &constants)
    }

    /// Replaces the Vulkan objects of a variant, and returns the old ones.
    pub(super) fn replace(&self, handles: Handles, variant: Variant) -> Option<Arc<Handles>> {
        let made = self.variants[variant.index()].write();
        made.unwrap_or_else(PoisonError::into_inner).replace(Arc::new(handles))
    }

    /// Destroys the Vulkan objects. No submission may use them any more.
    pub(super) fn destroy(&self, device: &ash::Device) {
        Variant::all()
            .filter_map(|variant| self.handles(variant))
            .for_each(|handles| handles.destroy(device));
    }

    /// Workgroups that cover `threads`. One-dimensional work is swizzled if the shader reads the
    /// number of workgroups.
    pub(super) fn workgroups(&self, tuning: &Tuning, limits: &Limits, threads: [u32; 3]) -> [u32; 3] {
        let local = self.module.local_size;
        let mut groups: [u32; 3] = std::array::from_fn(|axis| threads[axis].div_ceil(local[axis]));
        if self.module.has_workgroup_count && threads[1..] == [1, 1] && local[1..] == [1, 1] {
            groups = tuning.swizzled(groups[0]);
        }
        let most = limits.workgroup_count;
        let fits = groups.iter().zip(&most).all(|(groups, most)| groups <= most);
        assert!(fits, "`{}`: {groups:?} workgroups, the device takes {most:?}", self.stem);
        groups
    }
}

impl Handles {
    fn new(maker: Maker<'_>, shader: &Shader, module: &Module, constants: &Specialisation) -> Result<Self> {
        let stem = shader.stem;
        let mut handles = Self {
            pipeline: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
        };
        let made = handles
            .create_layout(maker, stem, module)
            .and_then(|()| handles.create_pipeline(maker, shader, constants))
            .and_then(|()| maker.optional.note_pipeline(stem, handles.pipeline));
        if made.is_err() {
            handles.destroy(maker.device);
        }
        made.map(|()| handles)
    }

    fn create_layout(&mut self, maker: Maker<'_>, stem: &str, module: &Module) -> Result<()> {
        let device = maker.device;
        let stages = vk::ShaderStageFlags::COMPUTE;
        let bindings: Vec<_> = module
            .bindings
            .iter()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.binding)
                    .descriptor_type(descriptor_type(binding))
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        self.set_layout =
            // SAFETY: the device and every object in the description are alive.
            unsafe { device.create_descriptor_set_layout(&info, None) }.vk("vkCreateDescriptorSetLayout")?;
        maker.names.set_name(self.set_layout, stem);

        let push_ranges: Vec<_> = module
            .push
            .iter()
            .map(|push| vk::PushConstantRange::default().stage_flags(stages).size(push.size))
            .collect();
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(std::slice::from_ref(&self.set_layout))
            .push_constant_ranges(&push_ranges);
        // SAFETY: the device and every object in the description are alive.
        self.layout = unsafe { device.create_pipeline_layout(&info, None) }.vk("vkCreatePipelineLayout")?;
        maker.names.set_name(self.layout, stem);
        Ok(())
    }

    fn create_pipeline(
        &mut self,
        maker: Maker<'_>,
        shader: &Shader,
        (entries, values): &Specialisation,
    ) -> Result<()> {
        let (device, stem) = (maker.device, shader.stem);
        let given: Vec<_> =
            entries.iter().map(|entry| entry.constant_id).zip(values.iter().copied()).collect();
        let words = dead_branches::remove(&shader.words(), &given);
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the device and every object in the description are alive.
        let module = unsafe { device.create_shader_module(&info, None) }.vk("vkCreateShaderModule")?;
        maker.names.set_name(module, stem);
        let specialisation =
            vk::SpecializationInfo::default().map_entries(entries).data(bytemuck::cast_slice(values));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&specialisation);
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(self.layout)
            .flags(maker.optional.pipeline_flags());
        // SAFETY: the device and every object in the description are alive; the cache locks itself.
        let created = unsafe { device.create_compute_pipelines(maker.cache, &[info], None) };
        // SAFETY: the pipeline that needed it is made.
        unsafe { device.destroy_shader_module(module, None) };
        let pipelines = created.map_err(|(_, result)| result).vk("vkCreateComputePipelines")?;
        self.pipeline = pipelines[0];
        maker.names.set_name(self.pipeline, stem);
        Ok(())
    }

    /// Destroys the objects. No submission may use them any more.
    pub(super) fn destroy(self, device: &ash::Device) {
        // Null handles, where creation stopped half-way, are ignored by Vulkan.
        // SAFETY: they are ours, made by this device, and no submission uses them any more.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// Map entries and values of the specialisation constants.
type Specialisation = (Vec<vk::SpecializationMapEntry>, Vec<u32>);

/// The specialisation of a module. Panics if a constant is missing or unknown; the
/// constants that follow from the bindings are not passed.
fn specialisation(stem: &str, module: &Module, given: &[(&str, u32)], variant: Variant) -> Specialisation {
    for (name, _) in given {
        let is_known = module.constants.iter().any(|constant| constant.name == *name);
        assert!(is_known, "`{stem}` has no specialisation constant `{name}`");
    }
    (0_u32..)
        .zip(&module.constants)
        .map(|(index, constant)| {
            let own = FROM_BINDINGS.into_iter().zip(variant.0.map(u32::from));
            let value = given.iter().copied().chain(own).find(|(name, _)| *name == constant.name);
            let (_, value) = value
                .unwrap_or_else(|| panic!("`{stem}` needs its specialisation constant `{}`", constant.name));
            let entry = vk::SpecializationMapEntry { constant_id: constant.id, offset: 4 * index, size: 4 };
            (entry, value)
        })
        .unzip()
}

/// Descriptor type of a binding.
pub(super) fn descriptor_type(binding: &Binding) -> vk::DescriptorType {
    if binding.is_texels {
        vk::DescriptorType::UNIFORM_TEXEL_BUFFER
    } else {
        vk::DescriptorType::STORAGE_BUFFER
    }
}

fn check_limits(stem: &str, module: &Module, limits: &Limits) -> Result<()> {
    let [x, y, z] = module.local_size;
    let [max_x, max_y, max_z] = limits.workgroup_size;
    let needs = [
        ("invocations in a workgroup", x * y * z, limits.workgroup_invocations),
        ("invocations along x", x, max_x),
        ("invocations along y", y, max_y),
        ("invocations along z", z, max_z),
        ("storage buffers", module.bindings.len() as u32, limits.storage_buffers),
        ("bytes of push constants", module.push.as_ref().map_or(0, |push| push.size), limits.push_bytes),
    ];
    match needs.iter().find(|(_, need, limit)| need > limit) {
        Some((what, need, limit)) => {
            Err(Error::OutOfMemory(format!("`{stem}` needs {need} {what}, the device has {limit}")))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shader_beyond_the_limits_is_refused_with_need_and_limit() {
        let module = Module { local_size: [512, 1, 1], ..Module::default() };
        let limits = Limits { workgroup_invocations: 256, workgroup_size: [1024; 3], ..Limits::default() };
        let message = check_limits("scan", &module, &limits).unwrap_err().to_string();
        assert!(
            message.contains("`scan` needs 512 invocations in a workgroup, the device has 256"),
            "{message}"
        );
    }

    #[test]
    #[should_panic(expected = "`scan` needs its specialisation constant `ITEMS`")]
    fn a_forgotten_constant_is_named() {
        let constant = spirv::Constant { id: 0, name: "ITEMS".into() };
        specialisation(
            "scan",
            &Module { constants: vec![constant], ..Module::default() },
            &[],
            Variant::default(),
        );
    }

    #[test]
    #[should_panic(expected = "`scan` has no specialisation constant `ITEM`")]
    fn an_unknown_constant_is_named() {
        specialisation("scan", &Module::default(), &[("ITEM", 1)], Variant::default());
    }
}
