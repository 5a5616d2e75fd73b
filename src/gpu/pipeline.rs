//! A compute shader made ready, with everything about it that its SPIR-V says.

use std::sync::{Arc, OnceLock};

use ash::vk;

use super::device::Limits;
use super::shaders::Shader;
use super::spirv::{self, Binding, FOLLOWS_ADDRESSES, Module};
use super::{Buffer, Context, VkResultExt};
use crate::error::{Error, Result};

/// A compute pipeline.
pub struct Pipeline {
    pub(super) stem: &'static str,
    pub(super) module: Module,
    context: Arc<Context>,
    /// Without the one that follows from the bindings.
    constants: Vec<(String, u32)>,
    direct: Arc<Handles>,
    /// For lists behind addresses; made when such are bound first.
    following: OnceLock<Arc<Handles>>,
}

/// The Vulkan objects of a pipeline. Recordings hold on to them until they are done.
pub(super) struct Handles {
    context: Arc<Context>,
    pub(super) pipeline: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
}

impl Pipeline {
    /// Makes the embedded shader `stem` ready, with a value for each of its specialisation constants, by name; a float
    /// passes its bits. Those of [`Tuning`](super::Tuning) may be left out. Panics where others are missing or any is unknown.
    ///
    /// # Errors
    /// The shader is beyond the device's limits, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, stem: &'static str, constants: &[(&str, u32)]) -> Result<Self> {
        let words = Shader::named(stem).words();
        let mut module = spirv::reflect(&words);
        let knows = |name: &str| module.constants.iter().any(|constant| constant.name == name);
        let is_given = |name: &str| constants.iter().any(|(given, _)| *given == name);
        let tuned = context.tuning().constants().into_iter();
        let tuned = tuned.filter(|(name, _)| knows(name) && !is_given(name));
        let constants: Vec<_> = constants.iter().copied().chain(tuned).collect();
        for (size, name) in module.local_size.iter_mut().zip(spirv::LOCAL_SIZE) {
            *size = constants.iter().find(|(given, _)| *given == name).map_or(*size, |(_, value)| *value);
        }
        check_limits(stem, &module, context.limits())?;
        let direct = Handles::new(context, stem, &module, &constants, false)?;
        let constants = constants.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        let following = OnceLock::new();
        Ok(Self { stem, module, context: context.clone(), constants, direct, following })
    }

    /// The Vulkan objects for these bindings: for lists themselves, or for lists behind addresses. Panics if the shader knows none such.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub(super) fn handles_for(&self, bindings: &[(&str, &Buffer)]) -> Result<&Arc<Handles>> {
        if !bindings.iter().any(|(_, buffer)| buffer.holds_address()) {
            return Ok(&self.direct);
        }
        if let Some(handles) = self.following.get() {
            return Ok(handles);
        }
        let knows = self.module.constants.iter().any(|constant| constant.name == FOLLOWS_ADDRESSES);
        assert!(knows, "`{}` does not follow addresses", self.stem);
        let constants: Vec<_> = self.constants.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let handles = Handles::new(&self.context, self.stem, &self.module, &constants, true)?;
        Ok(self.following.get_or_init(|| handles))
    }

    /// Invocations of a workgroup along each axis.
    pub fn local_size(&self) -> [u32; 3] {
        self.module.local_size
    }

    /// Workgroups that cover `threads`. Those of one-dimensional work are dealt as suits the device, if the shader knows how many there are.
    pub(super) fn workgroups(&self, threads: [u32; 3]) -> [u32; 3] {
        let local = self.module.local_size;
        let mut groups: [u32; 3] = std::array::from_fn(|axis| threads[axis].div_ceil(local[axis]));
        if self.module.has_workgroup_count && threads[1..] == [1, 1] && local[1..] == [1, 1] {
            groups = self.context.tuning().dealt(groups[0]);
        }
        let most = self.context.limits().workgroup_count;
        let fits = groups.iter().zip(&most).all(|(groups, most)| groups <= most);
        assert!(fits, "`{}`: {groups:?} workgroups, the device takes {most:?}", self.stem);
        groups
    }
}

impl Handles {
    fn new(
        context: &Arc<Context>,
        stem: &'static str,
        module: &Module,
        constants: &[(&str, u32)],
        follows_addresses: bool,
    ) -> Result<Arc<Self>> {
        let (entries, values) = specialisation(stem, module, constants, follows_addresses);
        let mut handles = Self {
            context: context.clone(),
            pipeline: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
        };
        handles.create_layout(stem, module)?;
        handles.create_pipeline(stem, &entries, &values)?;
        context.optional.note_pipeline(stem, handles.pipeline)?;
        Ok(Arc::new(handles))
    }

    fn create_layout(&mut self, stem: &str, module: &Module) -> Result<()> {
        let device = &self.context.device;
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
            // SAFETY: the device, and all that the description names, is alive.
            unsafe { device.create_descriptor_set_layout(&info, None) }.vk("vkCreateDescriptorSetLayout")?;
        self.context.set_name(self.set_layout, stem);

        let push_ranges: Vec<_> = module
            .push
            .iter()
            .map(|push| vk::PushConstantRange::default().stage_flags(stages).size(push.size))
            .collect();
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(std::slice::from_ref(&self.set_layout))
            .push_constant_ranges(&push_ranges);
        // SAFETY: the device, and all that the description names, is alive.
        self.layout = unsafe { device.create_pipeline_layout(&info, None) }.vk("vkCreatePipelineLayout")?;
        self.context.set_name(self.layout, stem);
        Ok(())
    }

    fn create_pipeline(
        &mut self,
        stem: &str,
        entries: &[vk::SpecializationMapEntry],
        values: &[u32],
    ) -> Result<()> {
        let device = &self.context.device;
        let words = Shader::named(stem).words();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the device, and all that the description names, is alive.
        let shader = unsafe { device.create_shader_module(&info, None) }.vk("vkCreateShaderModule")?;
        self.context.set_name(shader, stem);
        let specialisation =
            vk::SpecializationInfo::default().map_entries(entries).data(bytemuck::cast_slice(values));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(shader)
            .name(c"main")
            .specialization_info(&specialisation);
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(self.layout)
            .flags(self.context.optional.pipeline_flags());
        // SAFETY: the device, and all that the description names, is alive.
        let created = unsafe { device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None) };
        // SAFETY: the pipeline that needed it is made.
        unsafe { device.destroy_shader_module(shader, None) };
        let pipelines = created.map_err(|(_, result)| result).vk("vkCreateComputePipelines")?;
        self.pipeline = pipelines[0];
        self.context.set_name(self.pipeline, stem);
        Ok(())
    }
}

impl Drop for Handles {
    fn drop(&mut self) {
        // Null handles, where creation stopped half-way, are ignored by Vulkan.
        // SAFETY: it is ours, made by this device, and no submission uses it any more.
        unsafe {
            self.context.device.destroy_pipeline(self.pipeline, None);
            self.context.device.destroy_pipeline_layout(self.layout, None);
            self.context.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// The specialisation constants' places and values. Each must be given but for the one that follows from the bindings, and nothing else.
fn specialisation(
    stem: &str,
    module: &Module,
    given: &[(&str, u32)],
    follows_addresses: bool,
) -> (Vec<vk::SpecializationMapEntry>, Vec<u32>) {
    for (name, _) in given {
        let is_known = module.constants.iter().any(|constant| constant.name == *name);
        assert!(is_known, "`{stem}` has no specialisation constant `{name}`");
    }
    (0_u32..)
        .zip(&module.constants)
        .map(|(index, constant)| {
            let own = (FOLLOWS_ADDRESSES, u32::from(follows_addresses));
            let value = given.iter().copied().chain([own]).find(|(name, _)| *name == constant.name);
            let (_, value) = value
                .unwrap_or_else(|| panic!("`{stem}` needs its specialisation constant `{}`", constant.name));
            let entry = vk::SpecializationMapEntry { constant_id: constant.id, offset: 4 * index, size: 4 };
            (entry, value)
        })
        .unzip()
}

/// How a buffer is bound.
pub(super) fn descriptor_type(binding: &Binding) -> vk::DescriptorType {
    if binding.is_texels {
        vk::DescriptorType::UNIFORM_TEXEL_BUFFER
    } else {
        vk::DescriptorType::STORAGE_BUFFER
    }
}

fn check_limits(stem: &str, module: &Module, limits: &Limits) -> Result<()> {
    let [x, y, z] = module.local_size;
    let [most_x, most_y, most_z] = limits.workgroup_size;
    let needs = [
        ("invocations in a workgroup", x * y * z, limits.workgroup_invocations),
        ("invocations along x", x, most_x),
        ("invocations along y", y, most_y),
        ("invocations along z", z, most_z),
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
        specialisation("scan", &Module { constants: vec![constant], ..Module::default() }, &[], false);
    }

    #[test]
    #[should_panic(expected = "`scan` has no specialisation constant `ITEM`")]
    fn an_unknown_constant_is_named() {
        specialisation("scan", &Module::default(), &[("ITEM", 1)], false);
    }
}
