//! Optional abilities of a device that only profiling uses: a readable clock, and
//! statistics of pipelines.

use std::ffi::CStr;
use std::sync::Mutex;

use ash::vk;

use super::VkResultExt;
use super::instance::Instance;
use crate::error::Result;

/// Optional abilities that the device offers and the caller wants.
pub(super) struct Offers {
    clock: Option<&'static CStr>,
    executables: bool,
}

/// Optional abilities that are enabled.
pub(super) struct Optional {
    pub(super) clock: Option<DeviceClock>,
    executables: Option<ash::khr::pipeline_executable_properties::Device>,
    statistics: Mutex<Vec<PipelineStatistics>>,
}

/// Reads the device's clock from the host.
pub(super) enum DeviceClock {
    Khr(ash::khr::calibrated_timestamps::Device),
    Ext(ash::ext::calibrated_timestamps::Device),
}

/// A driver's statistics of one executable of a pipeline.
#[derive(Clone, Debug, PartialEq)]
pub struct PipelineStatistics {
    /// Stem of the shader.
    pub stem: &'static str,
    /// The driver's name for the executable; most pipelines have one.
    pub executable: String,
    /// Invocations that run in lockstep; 0 if the driver does not report it.
    pub subgroup_size: u32,
    /// Statistics in the driver's order.
    pub statistics: Vec<Statistic>,
}

/// One number, with the driver's name and description.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistic {
    /// Name, such as "Register Count".
    pub name: String,
    /// Description of the number, unit included.
    pub description: String,
    /// Value as text: drivers report integers, fractions and booleans.
    pub value: String,
}

impl Offers {
    /// Queries the abilities of a device. Statistics are queried only if they are wanted: drivers
    /// may store more for each pipeline then.
    pub(super) fn from_device(
        instance: &Instance,
        device: vk::PhysicalDevice,
        wants_statistics: bool,
    ) -> Result<Self> {
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        let extensions = unsafe { instance.raw.enumerate_device_extension_properties(device) }
            .vk("vkEnumerateDeviceExtensionProperties")?;
        let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let names = [ash::khr::calibrated_timestamps::NAME, ash::ext::calibrated_timestamps::NAME];
        let clock = match names.into_iter().find(|name| has(name)) {
            Some(name) if reads_device_clock(instance, device, name)? => Some(name),
            _ => None,
        };
        let executables = wants_statistics && has(ash::khr::pipeline_executable_properties::NAME) && {
            let mut executables = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
            let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut executables);
            // SAFETY: the queried objects are alive, and the result has the structures
            // that it needs.
            unsafe { instance.raw.get_physical_device_features2(device, &mut features) };
            executables.pipeline_executable_info == vk::TRUE
        };
        Ok(Self { clock, executables })
    }

    /// Names of the extensions to enable.
    pub(super) fn extensions(&self) -> impl Iterator<Item = &'static CStr> {
        let executables = self.executables.then_some(ash::khr::pipeline_executable_properties::NAME);
        self.clock.into_iter().chain(executables)
    }

    /// The feature of pipeline statistics, enabled or not.
    pub(super) fn feature(&self) -> vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR<'static> {
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
            .pipeline_executable_info(self.executables)
    }

    pub(super) fn reports_executables(&self) -> bool {
        self.executables
    }

    /// The functions of a device that was created with these extensions.
    pub(super) fn load(&self, instance: &Instance, device: &ash::Device) -> Optional {
        let clock = self.clock.map(|name| match name == ash::khr::calibrated_timestamps::NAME {
            true => DeviceClock::Khr(ash::khr::calibrated_timestamps::Device::new(&instance.raw, device)),
            false => DeviceClock::Ext(ash::ext::calibrated_timestamps::Device::new(&instance.raw, device)),
        });
        let executables = self
            .executables
            .then(|| ash::khr::pipeline_executable_properties::Device::new(&instance.raw, device));
        Optional { clock, executables, statistics: Mutex::default() }
    }
}

/// Whether the device's own clock can be read. The host's clock is read separately, before and
/// after, because the standard library does not document which system clock its instants use.
fn reads_device_clock(instance: &Instance, device: vk::PhysicalDevice, name: &CStr) -> Result<bool> {
    let domains = if name == ash::khr::calibrated_timestamps::NAME {
        let functions = ash::khr::calibrated_timestamps::Instance::new(instance.entry(), &instance.raw);
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        unsafe { functions.get_physical_device_calibrateable_time_domains(device) }
    } else {
        let functions = ash::ext::calibrated_timestamps::Instance::new(instance.entry(), &instance.raw);
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        unsafe { functions.get_physical_device_calibrateable_time_domains(device) }
    };
    Ok(domains.vk("vkGetPhysicalDeviceCalibrateableTimeDomains")?.contains(&vk::TimeDomainKHR::DEVICE))
}

impl DeviceClock {
    /// The device's clock now, in timestamp ticks, and its maximum deviation, nanoseconds.
    pub(super) fn read(&self) -> Result<(u64, u64)> {
        let info = [vk::CalibratedTimestampInfoKHR::default().time_domain(vk::TimeDomainKHR::DEVICE)];
        let (ticks, deviation_ns) = match self {
            // SAFETY: the queried objects are alive, and the result has the structures
            // that it needs.
            Self::Khr(functions) => unsafe { functions.get_calibrated_timestamps(&info) },
            // SAFETY: the queried objects are alive, and the result has the structures
            // that it needs.
            Self::Ext(functions) => unsafe { functions.get_calibrated_timestamps(&info) },
        }
        .vk("vkGetCalibratedTimestamps")?;
        Ok((ticks[0], deviation_ns))
    }
}

impl Optional {
    /// Flags for the creation of pipelines.
    pub(super) fn pipeline_flags(&self) -> vk::PipelineCreateFlags {
        match self.executables {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        }
    }

    /// Whether statistics of pipelines are queried.
    pub(super) fn reports_executables(&self) -> bool {
        self.executables.is_some()
    }

    /// Stores the statistics of a new pipeline, if they are wanted.
    pub(super) fn note_pipeline(&self, stem: &'static str, pipeline: vk::Pipeline) -> Result<()> {
        let Some(functions) = &self.executables else { return Ok(()) };
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline is alive, and made to tell of itself.
        let executables = unsafe { functions.get_pipeline_executable_properties(&info) }
            .vk("vkGetPipelineExecutablePropertiesKHR")?;
        for (index, executable) in (0..).zip(&executables) {
            let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index);
            // SAFETY: the same, of a part that it has just named.
            let told = unsafe { functions.get_pipeline_executable_statistics(&info) }
                .vk("vkGetPipelineExecutableStatisticsKHR")?;
            let statistic = |told: &vk::PipelineExecutableStatisticKHR| Statistic {
                name: text(told.name_as_c_str()),
                description: text(told.description_as_c_str()),
                value: value(told.format, told.value),
            };
            self.statistics.lock().expect("no holder panics").push(PipelineStatistics {
                stem,
                executable: text(executable.name_as_c_str()),
                subgroup_size: executable.subgroup_size,
                statistics: told.iter().map(statistic).collect(),
            });
        }
        Ok(())
    }

    pub(super) fn take_statistics(&self) -> Vec<PipelineStatistics> {
        std::mem::take(&mut self.statistics.lock().expect("no holder panics"))
    }
}

fn text(name: std::result::Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map_or_else(|_| "?".to_owned(), |name| name.to_string_lossy().into_owned())
}

fn value(
    format: vk::PipelineExecutableStatisticFormatKHR,
    value: vk::PipelineExecutableStatisticValueKHR,
) -> String {
    // SAFETY: the format says which member the driver wrote, and all bits of the integers and the
    // fraction mean something.
    unsafe {
        match format {
            vk::PipelineExecutableStatisticFormatKHR::BOOL32 => (value.b32 != vk::FALSE).to_string(),
            vk::PipelineExecutableStatisticFormatKHR::INT64 => value.i64.to_string(),
            vk::PipelineExecutableStatisticFormatKHR::UINT64 => value.u64.to_string(),
            vk::PipelineExecutableStatisticFormatKHR::FLOAT64 => format!("{:.3}", value.f64),
            _ => "?".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_read_as_the_driver_wrote_them() {
        use vk::PipelineExecutableStatisticFormatKHR as Format;
        use vk::PipelineExecutableStatisticValueKHR as Value;
        assert_eq!(value(Format::INT64, Value { i64: -3 }), "-3");
        assert_eq!(value(Format::UINT64, Value { u64: u64::MAX }), "18446744073709551615");
        assert_eq!(value(Format::FLOAT64, Value { f64: 0.5 }), "0.500");
        assert_eq!(value(Format::BOOL32, Value { b32: 1 }), "true");
    }
}
