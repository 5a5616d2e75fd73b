//! Names of Vulkan objects.

use std::ffi::CString;

use ash::vk;

/// Names of Vulkan objects for validation messages and debuggers. `None` if neither is active.
pub(super) struct Names(pub(super) Option<ash::ext::debug_utils::Device>);

impl Names {
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug_utils) = &self.0 else { return };
        let name = CString::new(name).expect("names hold no NUL");
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // A debug name is optional, so its failure is ignored.
        // SAFETY: the object is alive, and its name outlives the call.
        let _ = unsafe { debug_utils.set_debug_utils_object_name(&info) };
    }
}
