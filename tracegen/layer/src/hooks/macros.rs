//! Hooks that differ only in what they tell the tracker.

/// Hooks that tell the tracker about a call before they make it.
macro_rules! before {
    ($($hook:ident($first:ident: $handle:ty $(, $argument:ident: $kind:ty)* $(,)?) $(-> $result:ty)? |$device:ident| $tell:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook($first: $handle, $($argument: $kind),*) $(-> $result)? {
            // SAFETY: a valid call of the function; its arrays have the lengths in its arguments.
            unsafe {
                let $device = Device::of($first);
                $tell;
                ($device.next.$hook)($first, $($argument),*)
            }
        }
    )* };
}

/// Hooks that make a call before they tell the tracker about it and its result.
macro_rules! after {
    ($($hook:ident($first:ident: $handle:ty $(, $argument:ident: $kind:ty)* $(,)?) |$device:ident, $result:ident| $tell:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook($first: $handle, $($argument: $kind),*) -> vk::Result {
            // SAFETY: a valid call of the function; its arrays have the lengths in its arguments.
            unsafe {
                let $device = Device::of($first);
                let $result = ($device.next.$hook)($first, $($argument),*);
                $tell;
                $result
            }
        }
    )* };
}

/// Hooks of functions that create an object: its description, its kind, and what the tracker is told about it.
macro_rules! creates {
    ($($hook:ident $description:ident => $kind:ident |$device:ident, $info:ident, $object:ident| $tell:expr;)*) => { $(
        after! {
            $hook(handle: vk::Device, info: *const vk::$description<'_>, allocator: *const vk::AllocationCallbacks<'_>, object: *mut vk::$kind) |$device, result|
                if result == vk::Result::SUCCESS {
                    let ($info, $object) = (&*info, *object);
                    $tell;
                };
        }
    )* };
}

/// Hooks of functions that destroy an object: its kind, and what the tracker is told about it.
macro_rules! destroys {
    ($($hook:ident $kind:ident |$device:ident, $object:ident| $tell:expr;)*) => { $(
        before! {
            $hook(handle: vk::Device, $object: vk::$kind, allocator: *const vk::AllocationCallbacks<'_>) |$device| $tell;
        }
    )* };
}
