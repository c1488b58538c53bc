//! Image metrics: FLIP, PSNR, SSIM.
