//! Hooks that differ only in what the tracker records.

/// Hooks that record a call in the tracker, then make it.
macro_rules! before {
    ($($hook:ident($first:ident: $handle:ty $(, $argument:ident: $kind:ty)* $(,)?) $(-> $result:ty)? |$device:ident| $record:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook($first: $handle, $($argument: $kind),*) $(-> $result)? {
            // SAFETY: a valid call of the function; its arrays have the lengths in its arguments.
            unsafe {
                let $device = Device::of($first);
                $record;
                ($device.next.$hook)($first, $($argument),*)
            }
        }
    )* };
}

/// Hooks that make a call, then record it and its result in the tracker.
macro_rules! after {
    ($($hook:ident($first:ident: $handle:ty $(, $argument:ident: $kind:ty)* $(,)?) |$device:ident, $result:ident| $record:expr;)*) => { $(
        pub(super) unsafe extern "system" fn $hook($first: $handle, $($argument: $kind),*) -> vk::Result {
            // SAFETY: a valid call of the function; its arrays have the lengths in its arguments.
            unsafe {
                let $device = Device::of($first);
                let $result = ($device.next.$hook)($first, $($argument),*);
                $record;
                $result
            }
        }
    )* };
}

/// Hooks of functions that create an object: its description, its kind, and what the tracker records.
macro_rules! creates {
    ($($hook:ident $description:ident => $kind:ident |$device:ident, $info:ident, $object:ident| $record:expr;)*) => { $(
        after! {
            $hook(handle: vk::Device, info: *const vk::$description<'_>, allocator: *const vk::AllocationCallbacks<'_>, object: *mut vk::$kind) |$device, result|
                if result == vk::Result::SUCCESS {
                    let ($info, $object) = (&*info, *object);
                    $record;
                };
        }
    )* };
}

/// Hooks of functions that destroy an object: its kind, and what the tracker records.
macro_rules! destroys {
    ($($hook:ident $kind:ident |$device:ident, $object:ident| $record:expr;)*) => { $(
        before! {
            $hook(handle: vk::Device, $object: vk::$kind, allocator: *const vk::AllocationCallbacks<'_>) |$device| $record;
        }
    )* };
}
