//! The Vulkan instance: loader, validation layer, debug messages.

use std::ffi::{CStr, c_char, c_void};
use std::io::Write;
use std::sync::Mutex;

use ash::vk;

use super::VkResultExt;
use crate::error::{Error, Result, code};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

type Messages = Mutex<Vec<String>>;

/// An instance, with the messages of the validation layer if it is on.
pub(super) struct Instance {
    pub(super) raw: ash::Instance,
    pub(super) has_debug_utils: bool,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Boxed, because the messenger holds its address.
    messages: Box<Messages>,
    entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan, with the extensions of a window if there is one. With `validation`, the
    /// validation layer and its synchronisation checks must be installed.
    pub(super) fn new(validation: bool, window_extensions: &[*const c_char]) -> Result<Self> {
        // SAFETY: the loader is the system's Vulkan loader, whose initialisers may run.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| {
            Error::NoDevice(format!("the Vulkan loader is missing ({error}): install the package libvulkan1"))
        })?;
        if validation && !has_layer(&entry)? {
            return Err(Error::NoDevice(
                "validation was asked for and its layer is missing: install the package vulkan-validationlayers".into(),
            ));
        }
        // SAFETY: what `ash` passes on is alive during the call.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .vk("vkEnumerateInstanceExtensionProperties")?;
        let has_debug_utils = validation
            || extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME));
        refuse_missing(&extensions, window_extensions)?;
        let raw = create(&entry, validation, has_debug_utils, window_extensions)?;

        let messages = Box::<Messages>::default();
        let mut instance = Self { raw, has_debug_utils, messenger: None, messages, entry };
        if validation {
            let debug_utils = ash::ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                .message_severity(
                    vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                        | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                )
                .message_type(
                    vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                        | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
                )
                .pfn_user_callback(Some(on_message))
                .user_data((&raw const *instance.messages).cast_mut().cast());
            // SAFETY: the messages that the callback is given outlive the messenger (see `drop`).
            let messenger = unsafe { debug_utils.create_debug_utils_messenger(&info, None) }
                .vk("vkCreateDebugUtilsMessengerEXT")?;
            instance.messenger = Some((debug_utils, messenger));
        }
        Ok(instance)
    }

    /// The loader's functions.
    pub(super) fn entry(&self) -> &ash::Entry {
        &self.entry
    }

    /// The validation messages since the last call.
    pub(super) fn take_messages(&self) -> Vec<String> {
        std::mem::take(&mut self.messages.lock().expect("no holder panics"))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((debug_utils, messenger)) = self.messenger.take() {
            // SAFETY: it is ours, and whatever was made from it is gone.
            unsafe { debug_utils.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: it is ours, and whatever was made from it is gone.
        unsafe { self.raw.destroy_instance(None) };
        // No caller can take these messages any more: leaks appear when the device is destroyed.
        for message in self.take_messages() {
            // `drop` cannot return a failure of the output.
            let _ = writeln!(std::io::stderr(), "validation: {message}");
        }
    }
}

fn has_layer(entry: &ash::Entry) -> Result<bool> {
    let layers =
        // SAFETY: what `ash` passes on is alive during the call.
        unsafe { entry.enumerate_instance_layer_properties() }.vk("vkEnumerateInstanceLayerProperties")?;
    Ok(layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)))
}

fn refuse_missing(offered: &[vk::ExtensionProperties], wanted: &[*const c_char]) -> Result<()> {
    for &wanted in wanted {
        // SAFETY: names of extensions are constants that end in NUL.
        let wanted = unsafe { CStr::from_ptr(wanted) };
        if !offered.iter().any(|offered| offered.extension_name_as_c_str() == Ok(wanted)) {
            let name = wanted.to_string_lossy();
            return Err(Error::NoDevice(format!(
                "the Vulkan loader cannot draw to a window ({name} is missing): update your GPU's driver"
            )));
        }
    }
    Ok(())
}

fn create(
    entry: &ash::Entry,
    validation: bool,
    has_debug_utils: bool,
    window_extensions: &[*const c_char],
) -> Result<ash::Instance> {
    let application =
        vk::ApplicationInfo::default().application_name(c"lightpaths").api_version(vk::API_VERSION_1_2);
    let layers: &[_] = if validation { &[VALIDATION_LAYER.as_ptr()] } else { &[] };
    let mut extensions = window_extensions.to_vec();
    extensions.extend(has_debug_utils.then_some(ash::ext::debug_utils::NAME.as_ptr()));
    let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(layers)
        .enabled_extension_names(&extensions);
    if validation {
        info = info.push_next(&mut features);
    }
    // SAFETY: what `ash` passes on is alive during the call.
    unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::NoDevice(
            "no Vulkan driver is installed: install your GPU's driver, or the package mesa-vulkan-drivers \
             to render on the processor"
                .into(),
        ),
        vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
            Error::Vulkan { call: "vkCreateInstance", result, pass: None }
        }
        _ => Error::NoDevice(format!(
            "vkCreateInstance failed: {}: look at the variables VK_* of the environment, or install your GPU's driver anew",
            code(result)
        )),
    })
}

/// Collects one message of the validation layer.
///
/// SAFETY: Vulkan passes valid data for the time of the call, and `user` is the [`Messages`] that
/// the instance owns.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: see above.
    let (messages, message) = unsafe { (&*user.cast::<Messages>(), (*data).message_as_c_str()) };
    if let (Ok(mut messages), Some(message)) = (messages.lock(), message) {
        messages.push(message.to_string_lossy().into_owned());
    }
    vk::FALSE
}
