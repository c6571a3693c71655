use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::{RenderError, formats::COLOR_FORMAT};

/// Number of chunks of polygons that are bound at once. With the draw list they fill the eight storage buffers that every
/// adapter has.
pub(super) const CHUNKS_A_PAGE: usize = 7;

/// Number of storage buffers that the vertex shader reads: the draw list, and the chunks of one page.
pub(super) const STORAGE_BUFFERS: u32 = CHUNKS_A_PAGE as u32 + 1;

#[derive(Debug)]
pub struct Gpu {
    pub instance: wgpu::Instance,
    pub adapter: wgpu::Adapter,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    fault: Arc<Mutex<Option<Fault>>>,
    pub(super) samples_in_place: OnceLock<bool>,
}

#[derive(Clone, Debug)]
enum Fault {
    Lost(String),
    Reported(String),
}

impl Gpu {
    /// Opens the best adapter for pictures without a window. `WGPU_BACKEND=vulkan|gl` restricts the choice.
    ///
    /// # Errors
    /// The system has no adapter, or none with the required capabilities.
    pub fn headless() -> Result<Self, RenderError> {
        let open = |backends: wgpu::Backends| {
            let mut description = wgpu::InstanceDescriptor::new_without_display_handle();
            description.backends = backends;
            description.flags = instance_flags();
            pollster::block_on(Self::open(headless_instance(description.with_env()), None))
        };
        let best = open(wgpu::Backends::PRIMARY);
        // OpenGL is tried only with a display, because some drivers print errors without a display.
        let has_display = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
        match &best {
            Ok(gpu) if !gpu.is_software() || !has_display => best,
            _ => match (open(wgpu::Backends::GL), best) {
                (Ok(other), Ok(software)) if other.is_software() => Ok(software),
                (Ok(other), _) => Ok(other),
                (Err(_), best) => best,
            },
        }
    }

    /// Opens the best adapter; if there is a `surface`, the best that can show pictures on it.
    ///
    /// # Errors
    /// The system has no adapter, or none with the required capabilities.
    pub async fn open(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, RenderError> {
        let request = |force_fallback_adapter| {
            instance.request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                force_fallback_adapter,
                compatible_surface: surface,
                ..Default::default()
            })
        };
        // If the system has no other adapter, the first request finds a software adapter, too.
        let adapter = match request(false).await {
            Ok(adapter) => adapter,
            Err(_) => request(true).await.map_err(|_| RenderError::NoAdapter)?,
        };
        let name = describe(&adapter.get_info());
        if let Some(lacks) = missing(&adapter) {
            return Err(RenderError::Lacks { adapter: name, lacks });
        }
        let description = wgpu::DeviceDescriptor {
            label: Some("osp"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            // The limits are the adapter's own, because the default limits allow buffers of only 256 MiB.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let opened = adapter.request_device(&description).await;
        let (device, queue) =
            opened.map_err(|error| RenderError::NoDevice { adapter: name, reason: error.to_string() })?;
        let fault = Arc::new(Mutex::new(None));
        keep_first_fault(&device, &fault);
        Ok(Self { instance, adapter, device, queue, fault, samples_in_place: OnceLock::new() })
    }

    pub fn name(&self) -> String {
        describe(&self.adapter.get_info())
    }

    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    pub fn is_in_browser(&self) -> bool {
        self.adapter.get_info().backend == wgpu::Backend::BrowserWebGpu
    }

    /// Whether shaders can read each sample of a pixel. With OpenGL, wgpu makes no textures whose samples can be read.
    pub(super) fn reads_samples(&self) -> bool {
        self.adapter.get_info().backend != wgpu::Backend::Gl
    }

    /// Whether the samples of a pixel have their standard positions; `None` before the measurement.
    pub(super) fn samples_in_place(&self) -> Option<bool> {
        self.samples_in_place.get().copied()
    }

    /// Checks whether the device still works.
    ///
    /// # Errors
    /// The first fault since the device was opened: a lost device, or an error of the driver.
    pub fn check(&self) -> Result<(), RenderError> {
        match &*self.fault.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(Fault::Lost(reason)) => Err(RenderError::DeviceLost(reason.clone())),
            Some(Fault::Reported(reason)) => Err(RenderError::Device(reason.clone())),
        }
    }

    pub fn wait(&self) -> Result<(), RenderError> {
        let outcome = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        outcome.map(|_| ()).map_err(|error| RenderError::DeviceLost(error.to_string()))
    }
}

/// Flags of an instance for [`Gpu`]. They turn off wgpu's check of the arguments of indirect draw calls. The check is
/// unnecessary, because only shaders of this crate write these arguments, within bounds that the CPU has set. On
/// Windows the check stays on, because with Direct3D 12 it also passes the first vertex to the shader.
pub fn instance_flags() -> wgpu::InstanceFlags {
    let checked = wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
    let flags = wgpu::InstanceFlags::default();
    (if cfg!(windows) { flags } else { flags - checked }).with_env()
}

/// An instance for pictures without a window.
///
/// Vulkan is opened without Wayland's surfaces. With them, a layer of Mesa looks for a Wayland display, and prints an
/// error if the variable `XDG_RUNTIME_DIR` is missing.
fn headless_instance(description: wgpu::InstanceDescriptor) -> wgpu::Instance {
    #[cfg(target_os = "linux")]
    if (description.backends & (wgpu::Backends::VULKAN | wgpu::Backends::GL)) == wgpu::Backends::VULKAN
        && let Some(instance) = vulkan_without_wayland(&description)
    {
        return instance;
    }
    wgpu::Instance::new(description)
}

#[cfg(target_os = "linux")]
#[expect(unsafe_code, reason = "wgpu has no safe way to an instance without an extension")]
fn vulkan_without_wayland(description: &wgpu::InstanceDescriptor) -> Option<wgpu::Instance> {
    use wgpu::hal::{InstanceDescriptor, api::Vulkan, vulkan};
    let description = InstanceDescriptor {
        name: "osp",
        flags: description.flags,
        memory_budget_thresholds: description.memory_budget_thresholds,
        backend_options: description.backend_options.clone(),
        telemetry: None,
        display: None,
    };
    let leave_out: Box<vulkan::CreateInstanceCallback<'_>> =
        Box::new(|made| made.extensions.retain(|name| *name != c"VK_KHR_wayland_surface"));
    // SAFETY: The list of extensions is the one of a system without Wayland, which wgpu supports. No surface is made.
    let instance = unsafe { vulkan::Instance::init_with_callback(&description, Some(leave_out)) };
    // SAFETY: The instance is new, and nothing else refers to it.
    Some(unsafe { wgpu::Instance::from_hal::<Vulkan>(instance.ok()?) })
}

/// Stores the first fault for [`Gpu::check`], instead of the default handlers of wgpu, which panic.
fn keep_first_fault(device: &wgpu::Device, fault: &Arc<Mutex<Option<Fault>>>) {
    let keep = |slot: &Mutex<Option<Fault>>, new: Fault| {
        slot.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(new);
    };
    let slot = Arc::clone(fault);
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        keep(&slot, Fault::Reported(error.to_string().replace('\n', " ")));
    }));
    let slot = Arc::clone(fault);
    device.set_device_lost_callback(move |reason, message| {
        // A device that was dropped on purpose has no fault.
        if reason != wgpu::DeviceLostReason::Destroyed {
            keep(&slot, Fault::Lost(message.replace('\n', " ")));
        }
    });
}

fn describe(info: &wgpu::AdapterInfo) -> String {
    // A browser hides the name.
    let name = if info.name.is_empty() { "the browser's adapter" } else { &info.name };
    format!("{name} ({})", info.backend)
}

fn missing(adapter: &wgpu::Adapter) -> Option<&'static str> {
    let limits = adapter.limits();
    let flags = adapter.get_downlevel_capabilities().flags;
    if !flags.contains(wgpu::DownlevelFlags::VERTEX_STORAGE)
        || limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS
    {
        return Some("eight storage buffers in the vertex shader");
    }
    let multisampled = |format| {
        adapter
            .get_texture_format_features(format)
            .flags
            .contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_X4)
    };
    (!multisampled(COLOR_FORMAT)).then_some("four samples a pixel")
}
