//! Storage on the device, and transfers to and from it.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};

use super::barrier::TRANSFER_TO_HOST;
use super::buffer_name::BufferName;
use super::quirks::unused_bytes;
use super::spirv::USE_BUFFER_DEVICE_ADDRESS;
use super::{Context, VkResultExt};
use crate::error::{Error, Result};

/// Maximum size of a staging buffer, bytes. Longer transfers use it piece by piece.
const STAGING_BYTES: u64 = 16 << 20;

/// Minimum size of a buffer, bytes: a binding may not be empty.
pub(super) const MIN_BYTES: u64 = 16;

/// Usage flags of storage buffers.
const STORAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER.as_raw()
        | vk::BufferUsageFlags::INDIRECT_BUFFER.as_raw()
        | vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw(),
);

/// A storage buffer in device memory. Its contents are undefined until written.
pub struct Buffer {
    pub(super) allocated: Arc<Allocated>,
}

/// A buffer with its memory. Recordings keep it alive until they are done.
pub(super) struct Allocated {
    context: Arc<Context>,
    pub(super) handle: vk::Buffer,
    pub(super) name: String,
    /// What an out-of-memory message adds.
    hint: &'static str,
    /// Requested size, bytes.
    bytes: u64,
    /// Size that kernels can address, at least `bytes`.
    pub(super) bound_bytes: u64,
    location: MemoryLocation,
    /// View of the buffer as texels, created at the first use.
    texels: OnceLock<vk::BufferView>,
    /// Buffer to which the stored address points.
    pointee: Option<Arc<Self>>,
    /// Specialisation constants that kernels need for these contents.
    constants: Vec<&'static str>,
    /// `None` only during drop.
    allocation: Option<Allocation>,
}

impl Buffer {
    /// Creates a buffer of `bytes` bytes. An empty buffer can be bound, too. `name`
    /// appears in messages.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] with the need and the limit, if the device cannot bind or hold
    /// so much memory.
    pub fn storage<'a>(context: &Arc<Context>, name: impl Into<BufferName<'a>>, bytes: u64) -> Result<Self> {
        let name = name.into();
        let limit = context.limits().storage_range_bytes;
        if bytes > limit {
            return Err(out_of_memory(name, bytes, format!("the device binds at most {}", mebibytes(limit))));
        }
        let allocated = Allocated::new(context, name, bytes, STORAGE, MemoryLocation::GpuOnly)?;
        Ok(Self { allocated: Arc::new(allocated) })
    }

    /// Creates a buffer that holds `data`.
    ///
    /// # Errors
    /// As [`Buffer::storage`], or a Vulkan call failed.
    pub fn from_slice<'a, T: Pod>(
        context: &Arc<Context>,
        name: impl Into<BufferName<'a>>,
        data: &[T],
    ) -> Result<Self> {
        let buffer = Self::storage(context, name, size_of_val(data) as u64)?;
        buffer.write(data)?;
        Ok(buffer)
    }

    /// Creates a buffer of one item, whose first words are the address of `data`. `data` may be
    /// longer than a binding of the device. Only shaders with
    /// [`spirv::USE_BUFFER_DEVICE_ADDRESS`](super::spirv::USE_BUFFER_DEVICE_ADDRESS) read it;
    /// none writes it.
    ///
    /// # Errors
    /// As [`Buffer::from_slice`], without the limit of a binding.
    pub fn address_of<'a, T: Pod>(
        context: &Arc<Context>,
        name: impl Into<BufferName<'a>>,
        data: &[T],
    ) -> Result<Self> {
        let name = name.into();
        let usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let bytes = size_of_val(data) as u64;
        let list = Allocated::new(context, name, bytes, usage, MemoryLocation::GpuOnly)?;
        let info = vk::BufferDeviceAddressInfo::default().buffer(list.handle);
        // SAFETY: it is alive, and made by this device.
        let address = unsafe { context.device.get_buffer_device_address(&info) };
        let pointee = Self { allocated: Arc::new(list) };
        pointee.write(data)?;
        let table = format!("address of {}", name.name);
        let mut buffer = Allocated::new(
            context,
            BufferName { name: &table, ..name },
            size_of::<T>() as u64,
            STORAGE,
            MemoryLocation::GpuOnly,
        )?;
        buffer.pointee = Some(pointee.allocated);
        let buffer = Self { allocated: Arc::new(buffer) };
        buffer.write(&[address])?;
        Ok(buffer)
    }

    /// Creates a host-visible flag, zero. Kernels seldom write it, and the host reads it
    /// without a transfer.
    ///
    /// # Errors
    /// As [`Buffer::storage`].
    pub fn host_flag(context: &Arc<Context>, name: &str) -> Result<Self> {
        Self::host_words(context, name.into(), 1)
    }

    /// The value of a host-visible flag after the recordings that are done.
    pub fn read_flag(&self) -> u32 {
        self.mapped_word(0)
    }

    /// Name of a host-visible buffer that serves this one, with the same hint.
    pub(super) fn named_beside<'a>(&self, name: &'a str) -> BufferName<'a> {
        BufferName { name, hint: self.allocated.hint }
    }

    /// Creates a host-visible buffer of words, all zero.
    pub(super) fn host_words(context: &Arc<Context>, name: BufferName<'_>, words: u32) -> Result<Self> {
        let bytes = 4 * u64::from(words);
        let allocated = Allocated::new(context, name, bytes, STORAGE, MemoryLocation::GpuToCpu)?;
        allocated.store(&vec![0; bytes as usize]);
        Ok(Self { allocated: Arc::new(allocated) })
    }

    /// Creates a buffer that the host writes and copies read.
    pub(super) fn host_upload(context: &Arc<Context>, name: BufferName<'_>, bytes: u64) -> Result<Self> {
        let (usage, location) = (vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu);
        Ok(Self { allocated: Arc::new(Allocated::new(context, name, bytes, usage, location)?) })
    }

    /// Overwrites the start of a buffer of [`Self::host_upload`].
    pub(super) fn write_mapped(&self, data: &[u8]) {
        self.allocated.store(data);
    }

    /// The first elements of a host-visible buffer.
    pub(super) fn read_mapped<T: Pod>(&self, count: usize) -> Vec<T> {
        let mut data = vec![T::zeroed(); count];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        bytes.copy_from_slice(&self.allocated.mapped()[..bytes.len()]);
        data
    }

    /// A word of a host-visible buffer.
    pub(super) fn mapped_word(&self, index: u32) -> u32 {
        let first = 4 * index as usize;
        bytemuck::pod_read_unaligned(&self.allocated.mapped()[first..first + 4])
    }

    pub(super) fn is_host_flag(&self) -> bool {
        self.allocated.location == MemoryLocation::GpuToCpu
    }

    /// Another handle to the same storage.
    #[must_use]
    pub fn alias(&self) -> Self {
        Self { allocated: self.allocated.clone() }
    }

    /// The buffer to which the stored address points, or the buffer itself if it stores none.
    pub fn followed(&self) -> Self {
        Self { allocated: self.allocated.pointee.as_ref().unwrap_or(&self.allocated).clone() }
    }

    /// The buffer, whose contents need variants of kernels in which a constant of
    /// [`spirv::FROM_BINDINGS`](super::spirv::FROM_BINDINGS) is 1. Kernels without it are not
    /// affected. Panics if there is another handle to the buffer.
    #[must_use]
    pub fn with_constant(mut self, name: &'static str) -> Self {
        let allocated = Arc::get_mut(&mut self.allocated).expect("a new buffer has one handle");
        allocated.constants.push(name);
        self
    }

    pub(super) fn needs_constant(&self, name: &str) -> bool {
        let Allocated { pointee, constants, .. } = &*self.allocated;
        constants.contains(&name) || name == USE_BUFFER_DEVICE_ADDRESS && pointee.is_some()
    }

    /// Requested size, bytes.
    pub fn bytes(&self) -> u64 {
        self.allocated.bytes
    }

    /// Overwrites the start of the buffer with `data`. Panics if the data is longer
    /// than the buffer.
    ///
    /// # Errors
    /// A Vulkan call failed, or there is no memory to stage the transfer in.
    pub fn write<T: Pod>(&self, data: &[T]) -> Result<()> {
        self.write_range(0, data)
    }

    /// Overwrites elements from number `first` on. Panics if the buffer ends before the data.
    ///
    /// # Errors
    /// As [`Buffer::write`].
    pub fn write_range<T: Pod>(&self, first: usize, data: &[T]) -> Result<()> {
        let mut offset = (first * size_of::<T>()) as u64;
        let data: &[u8] = bytemuck::cast_slice(data);
        let (end, name) = (offset + data.len() as u64, &self.allocated.name);
        assert!(end <= self.bytes(), "`{name}` holds {} bytes, {end} given", self.bytes());
        if data.is_empty() {
            return Ok(());
        }
        let staging = self.staging(data.len() as u64, MemoryLocation::CpuToGpu)?;
        for piece in data.chunks(STAGING_BYTES as usize) {
            let (bytes, begun) = (piece.len() as u64, Instant::now());
            staging.allocated.store(piece);
            self.allocated.context.timeline.note_copy("stage", name, begun, bytes);
            self.allocated.context.run(|rec| rec.copy_bytes(&staging, 0, self, offset, bytes))?;
            offset += bytes;
        }
        Ok(())
    }

    /// Reads the whole buffer. Panics if its size is no multiple of an element's.
    ///
    /// # Errors
    /// As [`Buffer::write`].
    pub fn read<T: Pod>(&self) -> Result<Vec<T>> {
        let (bytes, element) = (self.bytes() as usize, size_of::<T>());
        assert!(bytes.is_multiple_of(element), "`{}` does not hold whole elements", self.allocated.name);
        self.read_range(0, bytes / element)
    }

    /// Reads `count` elements from element `first` on. Panics if the buffer ends before.
    ///
    /// # Errors
    /// As [`Buffer::write`].
    pub fn read_range<T: Pod>(&self, first: usize, count: usize) -> Result<Vec<T>> {
        let mut data = vec![T::zeroed(); count];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        self.allocated.context.count_commands(|counts| counts.read_back_bytes += bytes.len() as u64);
        let mut offset = (first * size_of::<T>()) as u64;
        let (end, name) = (offset + bytes.len() as u64, &self.allocated.name);
        assert!(end <= self.bytes(), "`{name}` holds {} bytes, reading up to {end}", self.bytes());
        if bytes.is_empty() {
            return Ok(data);
        }
        let staging = self.staging(bytes.len() as u64, MemoryLocation::GpuToCpu)?;
        for piece in bytes.chunks_mut(STAGING_BYTES as usize) {
            self.allocated.context.run(|rec| {
                rec.copy_bytes(self, offset, &staging, 0, piece.len() as u64);
                // Not reported to the hazard check, which does not track the host.
                rec.pipeline_barrier(TRANSFER_TO_HOST);
            })?;
            let begun = Instant::now();
            piece.copy_from_slice(&staging.allocated.mapped()[..piece.len()]);
            self.allocated.context.timeline.note_copy("read back", name, begun, piece.len() as u64);
            offset += piece.len() as u64;
        }
        Ok(data)
    }

    fn staging(&self, bytes: u64, location: MemoryLocation) -> Result<Self> {
        let usage = match location {
            MemoryLocation::CpuToGpu => vk::BufferUsageFlags::TRANSFER_SRC,
            _ => vk::BufferUsageFlags::TRANSFER_DST,
        };
        let bytes = bytes.min(STAGING_BYTES);
        let allocated = Allocated::new(&self.allocated.context, "staging".into(), bytes, usage, location)?;
        Ok(Self { allocated: Arc::new(allocated) })
    }
}

impl Allocated {
    fn new(
        context: &Arc<Context>,
        BufferName { name, hint }: BufferName<'_>,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self> {
        // Fills work on words, and a texel has four.
        let bound_bytes = bytes.max(MIN_BYTES).next_multiple_of(16);
        let info = vk::BufferCreateInfo::default().size(bound_bytes + unused_bytes(bound_bytes)).usage(usage);
        // SAFETY: the device and every object in the description are alive.
        let handle = unsafe { context.device.create_buffer(&info, None) }.vk("vkCreateBuffer")?;
        let mut allocated = Self {
            context: context.clone(),
            handle,
            name: name.into(),
            hint,
            bytes,
            bound_bytes,
            location,
            texels: OnceLock::new(),
            pointee: None,
            constants: Vec::new(),
            allocation: None,
        };
        context.set_name(handle, name);
        // SAFETY: it is alive, and made by this device.
        let requirements = unsafe { context.device.get_buffer_memory_requirements(handle) };
        let allocate = |allocation_scheme| {
            let request =
                AllocationCreateDesc { name, requirements, location, linear: true, allocation_scheme };
            context.with_allocator(|allocator| allocator.allocate(&request))
        };
        // If there is no memory for a block, there may be enough for this buffer alone.
        let allocation = allocate(AllocationScheme::GpuAllocatorManaged)
            .or_else(|_| allocate(AllocationScheme::DedicatedBuffer(handle)))
            .map_err(|error| {
                let in_use = mebibytes(context.memory().current_bytes);
                let most = mebibytes(context.limits().device_memory_bytes);
                let why = failure(&error);
                out_of_memory(
                    BufferName { name, hint },
                    bytes,
                    format!("{in_use} are in use, the device has {most} ({why})"),
                )
            })?;
        // SAFETY: the memory is the allocator's, fits the requirements, and outlives the
        // buffer (see `drop`).
        unsafe { context.device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) }
            .vk("vkBindBufferMemory")?;
        allocated.allocation = Some(allocation);
        allocated.count(usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER));
        Ok(allocated)
    }

    /// The view for kernels that read texels of four words.
    pub(super) fn texels(&self) -> Result<vk::BufferView> {
        if let Some(&view) = self.texels.get() {
            return Ok(view);
        }
        let info = vk::BufferViewCreateInfo::default()
            .buffer(self.handle)
            .format(vk::Format::R32G32B32A32_UINT)
            .range(self.bound_bytes + unused_bytes(self.bound_bytes));
        // SAFETY: the buffer is ours, and the view covers what it has.
        let view = unsafe { self.context.device.create_buffer_view(&info, None) }.vk("vkCreateBufferView")?;
        self.context.set_name(view, &self.name);
        let kept = *self.texels.get_or_init(|| view);
        if kept != view {
            // Another thread was faster.
            // SAFETY: this view is not stored, so no other code uses it.
            unsafe { self.context.device.destroy_buffer_view(view, None) };
        }
        Ok(kept)
    }

    fn count(&self, is_bound: bool) {
        let mut memory = self.context.memory.lock().expect("no holder panics");
        if self.location == MemoryLocation::GpuOnly {
            memory.current_bytes += self.bytes;
            memory.peak_bytes = memory.peak_bytes.max(memory.current_bytes);
            if is_bound {
                memory.largest_binding_bytes = memory.largest_binding_bytes.max(self.bytes);
            }
        } else {
            memory.staging_bytes += self.bytes;
            memory.peak_staging_bytes = memory.peak_staging_bytes.max(memory.staging_bytes);
        }
    }

    /// The memory of a staging buffer, or of a host flag.
    fn mapped(&self) -> &[u8] {
        self.allocation.as_ref().and_then(Allocation::mapped_slice).expect("the host's memory is mapped")
    }

    /// Writes to the start of a staging buffer, or to a new host flag.
    fn store(&self, data: &[u8]) {
        let mapped = self.mapped();
        assert!(data.len() <= mapped.len(), "pieces fit the staging buffer");
        // SAFETY: the memory is mapped for writing, at least as long as the data (asserted), and no
        // other code uses it. The staging buffer is local to one transfer whose submissions are
        // done, and a new host flag has no other owner.
        unsafe { std::ptr::copy_nonoverlapping(data.as_ptr(), mapped.as_ptr().cast_mut(), data.len()) };
    }
}

impl Drop for Allocated {
    fn drop(&mut self) {
        if let Some(&view) = self.texels.get() {
            // SAFETY: it is ours, made by this device, and no submission uses it any more.
            unsafe { self.context.device.destroy_buffer_view(view, None) };
        }
        // SAFETY: as above.
        unsafe { self.context.device.destroy_buffer(self.handle, None) };
        let Some(allocation) = self.allocation.take() else { return };
        self.context
            .with_allocator(|allocator| allocator.free(allocation))
            .expect("the allocation came from this allocator");
        let mut memory = self.context.memory.lock().expect("no holder panics");
        if self.location == MemoryLocation::GpuOnly {
            memory.current_bytes -= self.bytes;
        } else {
            memory.staging_bytes -= self.bytes;
        }
    }
}

/// The call that failed, and its result.
fn failure(error: &AllocationError) -> String {
    match error {
        AllocationError::OutOfMemory => "vkAllocateMemory: VK_ERROR_OUT_OF_DEVICE_MEMORY".to_owned(),
        AllocationError::FailedToMap(why) => format!("vkMapMemory: {why}"),
        // The text has the call and its code.
        other => other.to_string(),
    }
}

fn out_of_memory(BufferName { name, hint }: BufferName<'_>, bytes: u64, limit: String) -> Error {
    Error::OutOfMemory(format!("buffer `{name}` needs {}, {limit}; {hint}", mebibytes(bytes)))
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}
