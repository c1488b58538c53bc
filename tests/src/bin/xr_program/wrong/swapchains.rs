//! Swapchains and their images.

use super::*;

pub(super) fn release(api: &Api, chain: xr::Swapchain) -> Result<()> {
    let mut image = 0;
    let wait: xr::SwapchainImageWaitInfo = of(Type::SWAPCHAIN_IMAGE_WAIT_INFO);
    xr_do!(api, AcquireSwapchainImage(chain, null(), &mut image));
    xr_do!(api, WaitSwapchainImage(chain, &wait));
    xr_do!(api, ReleaseSwapchainImage(chain, null()));
    Ok(())
}

/// Returns a swapchain of which no image was released.
pub(super) fn swapchains(checks: &mut Checks, opened: &Opened) -> Result<xr::Swapchain> {
    let (api, session) = (&opened.api, opened.session);
    let good = swapchain_info([64, 64], 1);
    let with = |change: &dyn Fn(&mut xr::SwapchainCreateInfo)| {
        let (mut info, mut chain) = (good, xr::Swapchain::default());
        change(&mut info);
        let code = xr_call!(api, CreateSwapchain(session, &info, &mut chain));
        (code, chain)
    };
    checks.expect(
        "an unknown format",
        with(&|i| i.format = 9999).0,
        Code::ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED,
    );
    checks.expect("no width", with(&|i| i.width = 0).0, INVALID);
    checks.expect("a large height", with(&|i| i.height = 1 << 20).0, INVALID);
    checks.expect("two faces", with(&|i| i.face_count = 2).0, INVALID);
    checks.expect("no layers", with(&|i| i.array_size = 0).0, INVALID);
    checks.expect("no levels", with(&|i| i.mip_count = 0).0, INVALID);
    checks.expect(
        "three samples",
        with(&|i| i.sample_count = 3).0,
        Code::ERROR_FEATURE_UNSUPPORTED,
    );
    checks.expect(
        "protected",
        with(&|i| i.create_flags = xr::SwapchainCreateFlags::PROTECTED_CONTENT).0,
        Code::ERROR_FEATURE_UNSUPPORTED,
    );
    checks.expect(
        "a swapchain of another type",
        with(&|i| i.ty = Type::UNKNOWN).0,
        INVALID,
    );
    let (code, fixed) = with(&|i| i.create_flags = xr::SwapchainCreateFlags::STATIC_IMAGE);
    checks.expect("a static image", code, DONE);
    let mut index = 0;
    release(api, fixed)?;
    checks.expect(
        "a static image again",
        xr_call!(api, AcquireSwapchainImage(fixed, null(), &mut index)),
        ORDER,
    );
    checks.expect(
        "a destroyed swapchain",
        xr_call!(api, DestroySwapchain(fixed)),
        DONE,
    );
    let (code, samples) = with(&|i| i.sample_count = 4);
    checks.expect(
        "four samples",
        (code, xr_call!(api, DestroySwapchain(samples))),
        (DONE, DONE),
    );
    let (code, chain) = with(&|_| ());
    checks.expect("a swapchain", code, DONE);
    let mut images: [xr::SwapchainImageVulkanKHR; 3] = [
        Type::SWAPCHAIN_IMAGE_VULKAN_KHR,
        Type::UNKNOWN,
        Type::SWAPCHAIN_IMAGE_VULKAN_KHR,
    ]
    .map(of);
    let mut count = 0;
    let mut list = |capacity, images: &mut [xr::SwapchainImageVulkanKHR; 3]| {
        let code = xr_call!(
            api,
            EnumerateSwapchainImages(chain, capacity, &mut count, images.as_mut_ptr().cast())
        );
        (code, count)
    };
    checks.expect("two images", list(2, &mut images), (SIZE, 3));
    checks.expect("an image of another type", list(3, &mut images).0, INVALID);
    images[1].ty = Type::SWAPCHAIN_IMAGE_VULKAN_KHR;
    checks.expect("three images", list(3, &mut images), (DONE, 3));
    checks.expect(
        "different images",
        images[0].image != images[1].image && images[1].image != images[2].image,
        true,
    );
    let mut wait: xr::SwapchainImageWaitInfo = of(Type::SWAPCHAIN_IMAGE_WAIT_INFO);
    checks.expect(
        "a wait for nothing",
        xr_call!(api, WaitSwapchainImage(chain, &wait)),
        ORDER,
    );
    checks.expect(
        "a release of nothing",
        xr_call!(api, ReleaseSwapchainImage(chain, null())),
        ORDER,
    );
    let (_, other) = with(&|_| ());
    for number in 0..3 {
        checks.expect(
            "an image",
            (
                xr_call!(api, AcquireSwapchainImage(other, null(), &mut index)),
                index,
            ),
            (DONE, number),
        );
    }
    checks.expect(
        "a fourth image",
        xr_call!(api, AcquireSwapchainImage(other, null(), &mut index)),
        ORDER,
    );
    checks.expect(
        "a release without a wait",
        xr_call!(api, ReleaseSwapchainImage(other, null())),
        ORDER,
    );
    wait.ty = Type::UNKNOWN;
    checks.expect(
        "a wait of another type",
        xr_call!(api, WaitSwapchainImage(other, &wait)),
        INVALID,
    );
    wait.ty = Type::SWAPCHAIN_IMAGE_WAIT_INFO;
    checks.expect(
        "a wait",
        xr_call!(api, WaitSwapchainImage(other, &wait)),
        DONE,
    );
    checks.expect(
        "a second wait",
        xr_call!(api, WaitSwapchainImage(other, &wait)),
        ORDER,
    );
    checks.expect(
        "a release",
        xr_call!(api, ReleaseSwapchainImage(other, null())),
        DONE,
    );
    Ok(chain)
}
