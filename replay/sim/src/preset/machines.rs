//! GPUs of headsets and phones since 2020, one table each. A value without a public document or measurement of this GPU
//! or its generation is a range. `docs/models/machines.md` shows the tables.

use super::machine::Key::{
    Cores, DramChannels, DramDevice, L1Bytes, L1Ways, L2Bytes, L2SetIndex, L2Ways, LineBytes,
    TilePx,
};
use super::machine::{Key, Machine, Setting};

/// A published or measured value.
const fn known(key: Key, value: u64, source: &'static str) -> Setting {
    Setting {
        key,
        value,
        range: None,
        source,
    }
}

/// A value between `low` and `high`.
const fn between(key: Key, low: u64, value: u64, high: u64, source: &'static str) -> Setting {
    Setting {
        key,
        value,
        range: Some([low, high]),
        source,
    }
}

const KIB: u64 = 1 << 10;
const MODULO: u64 = 0;
const XOR: u64 = 1;
/// Positions in `DramPreset::ALL`.
const LPDDR5: u64 = 1;

const NO_WAYS: &str =
    "not published: 4 to 16, the ways of the L1 and L2 of other GPUs (AMD GCN whitepaper, 2012)";
const NO_INDEX: &str = "not published: low bits or hashed, as in GPUs that state it (ROCm Compute Profiler: hashed L2 channels)";
const BINS: &str = "bins fill the on-chip memory (tile_align_w and tile_align_h in Mesa are least sizes); the order inside a bin is not published: 16 to 64, the model's largest";
const MALI_TILES: &str = "fragment tasks of 32x32 pixels (Arm, counter reference of the Mali-G77); the tiles inside are not published: 16 to 32";
const MALI_L1: &str = "Arm GPU Datasheet (102849), texture cache";

/// Keys that no vendor publishes for a GPU.
const OPEN_L1_WAYS: Setting = between(L1Ways, 4, 8, 16, NO_WAYS);
const OPEN_L2_WAYS: Setting = between(L2Ways, 4, 8, 16, NO_WAYS);
const OPEN_L2_INDEX: Setting = between(L2SetIndex, MODULO, XOR, XOR, NO_INDEX);
const BIN: Setting = between(TilePx, 16, 64, 64, BINS);
const MALI_TILE: Setting = between(TilePx, 16, 16, 32, MALI_TILES);

/// Adreno 650.
pub(super) const ADRENO_650: Machine = Machine {
    name: "adreno-650",
    help: "Adreno 650: Snapdragon 865 and XR2 (Quest 2, Pico 4), 2020",
    settings: &[
        known(
            Cores,
            3,
            "OpenCL of an Adreno 650: 3 compute units (xmrig issue 2383); Mesa, freedreno/common/a6xx_gpu.py: num_ccu",
        ),
        BIN,
        known(
            LineBytes,
            64,
            "OpenCL of an Adreno 650: global memory cache line (xmrig issue 2383)",
        ),
        known(
            L1Bytes,
            KIB,
            "of the same generation: 1 KiB in the Adreno 630 (Romou, MobiCom 2022) and 640 (Chips and Cheese, 2024)",
        ),
        OPEN_L1_WAYS,
        known(
            L2Bytes,
            128 * KIB,
            "OpenCL of an Adreno 650: global memory cache (xmrig issue 2383)",
        ),
        OPEN_L2_WAYS,
        OPEN_L2_INDEX,
        known(
            DramDevice,
            LPDDR5,
            "Snapdragon 865: LPDDR5 at 2750 MHz or LPDDR4X at 2133 MHz (AnandTech, 2019); the model's device runs at 3200 MHz",
        ),
        known(
            DramChannels,
            4,
            "Snapdragon 865: four channels of 16 bits (AnandTech, 2019)",
        ),
    ],
};

/// Adreno 740.
pub(super) const ADRENO_740: Machine = Machine {
    name: "adreno-740",
    help: "Adreno 740: Snapdragon 8 Gen 2 and XR2 Gen 2 (Quest 3), 2022",
    settings: &[
        known(Cores, 6, "Mesa, freedreno/common/a7xx_gpu.py: num_ccu"),
        BIN,
        known(
            LineBytes,
            64,
            "64 in the Adreno 650 and in the Adreno 830 (OpenCL, xmrig issue 2383 and ggml-org/whisper.cpp issue 3708)",
        ),
        between(
            L1Bytes,
            KIB,
            2 * KIB,
            4 * KIB,
            "not published: 1 KiB as in Adreno 6xx, to four times that",
        ),
        OPEN_L1_WAYS,
        between(
            L2Bytes,
            512 * KIB,
            1024 * KIB,
            1024 * KIB,
            "not published: 1 MiB in the Adreno X1, which Mesa configures alike (die measurement, topcpu.net, 2025), and in the Adreno 830 (OpenCL, ggml-org/whisper.cpp issue 3708), to half that. The X1's cluster caches are not modelled",
        ),
        OPEN_L2_WAYS,
        OPEN_L2_INDEX,
        known(DramDevice, LPDDR5, "assumed, as in the Snapdragon 865"),
        known(DramChannels, 4, "assumed, as in the Snapdragon 865"),
    ],
};

/// Mali-G78.
pub(super) const MALI_G78: Machine = Machine {
    name: "mali-g78",
    help: "Mali-G78 MP20: Google Tensor (Pixel 6), 2021",
    settings: &[
        known(
            Cores,
            20,
            "panfrost's boot log on a Pixel 6 (postmarketOS port of m8l8th814n-eng): shader_present 0x779fff",
        ),
        MALI_TILE,
        known(
            LineBytes,
            64,
            "the same log: L2_FEATURES 0x08130206, bits 0 to 7",
        ),
        known(L1Bytes, 32 * KIB, MALI_L1),
        OPEN_L1_WAYS,
        known(
            L2Bytes,
            2048 * KIB,
            "the same log: L2_FEATURES bits 16 to 23 (512 KiB a slice), MEM_FEATURES 0x301 (four slices); 2 MiB also in a Kirin 9000 (ArchProbe issue 10)",
        ),
        known(L2Ways, 4, "the same log: L2_FEATURES bits 8 to 15"),
        OPEN_L2_INDEX,
        known(DramDevice, LPDDR5, "Google Tensor: LPDDR5 (nanoreview.net)"),
        known(
            DramChannels,
            4,
            "Google Tensor G2: four channels of 16 bits (nanoreview.net)",
        ),
    ],
};

/// Mali-G710.
pub(super) const MALI_G710: Machine = Machine {
    name: "mali-g710",
    help: "Mali-G710 MP7: Google Tensor G2 (Pixel 7), 2022",
    settings: &[
        known(
            Cores,
            7,
            "panthor on a Pixel 7 Pro (GS201 GPU bring-up, 2026): shader_present 0x1110055",
        ),
        MALI_TILE,
        known(
            LineBytes,
            64,
            "the same bring-up: L2_FEATURES 0x08130306, bits 0 to 7",
        ),
        known(L1Bytes, 32 * KIB, MALI_L1),
        OPEN_L1_WAYS,
        known(
            L2Bytes,
            2048 * KIB,
            "OpenCL on a Pixel 7: global memory cache (ggml-org/llama.cpp issue 2636)",
        ),
        known(L2Ways, 8, "the same bring-up: L2_FEATURES bits 8 to 15"),
        OPEN_L2_INDEX,
        known(
            DramDevice,
            LPDDR5,
            "Google Tensor G2: LPDDR5 (nanoreview.net)",
        ),
        known(
            DramChannels,
            4,
            "Google Tensor G2: four channels of 16 bits (nanoreview.net)",
        ),
    ],
};

/// Mali-G715.
pub(super) const MALI_G715: Machine = Machine {
    name: "mali-g715",
    help: "Mali-G715 MP7: Google Tensor G3 (Pixel 8), 2023",
    settings: &[
        known(
            Cores,
            7,
            "VK_ARM_shader_core_builtins on a Mali-G715 MP7: shaderCoreCount 7 (vulkan.gpuinfo.org)",
        ),
        MALI_TILE,
        known(
            LineBytes,
            64,
            "Arm, The Valhall Shader Core (102203): 64-byte lines",
        ),
        known(L1Bytes, 32 * KIB, MALI_L1),
        OPEN_L1_WAYS,
        between(
            L2Bytes,
            1024 * KIB,
            2048 * KIB,
            2048 * KIB,
            "not published: between those of the generations before and after, 512 KiB a slice and 2 to 4 slices (panthor, Mali-G710 and Immortalis-G925)",
        ),
        known(
            L2Ways,
            8,
            "of the generations before and after: L2_FEATURES of a Mali-G710 and an Immortalis-G925 (panthor)",
        ),
        OPEN_L2_INDEX,
        known(DramDevice, LPDDR5, "assumed, as in the Google Tensor G2"),
        known(DramChannels, 4, "assumed, as in the Google Tensor G2"),
    ],
};

/// Apple M2.
pub(super) const APPLE_M2: Machine = Machine {
    name: "apple-m2",
    help: "Apple M2 with 10 GPU cores (Vision Pro), 2022",
    settings: &[
        known(
            Cores,
            10,
            "MacRumors, 2024: the Vision Pro's M2 has 10 GPU cores",
        ),
        between(
            TilePx,
            16,
            32,
            32,
            "Apple, MTLRenderPassDescriptor.tileHeight: 32x32, 32x16 or 16x16",
        ),
        known(
            LineBytes,
            128,
            "philipturner/metal-benchmarks: global cache line of Apple 7 and 8",
        ),
        known(
            L1Bytes,
            8 * KIB,
            "Chips and Cheese, 2023, of the M2 Pro; philipturner/metal-benchmarks, data cache of Apple 7 and 8",
        ),
        OPEN_L1_WAYS,
        between(
            L2Bytes,
            1024 * KIB,
            1024 * KIB,
            2048 * KIB,
            "about 1.5 MiB (philipturner/metal-benchmarks): the powers of two around it",
        ),
        OPEN_L2_WAYS,
        OPEN_L2_INDEX,
        known(
            DramDevice,
            LPDDR5,
            "LPDDR5-6400 (AnandTech, Apple Announces M2 SoC, 2022)",
        ),
        known(
            DramChannels,
            8,
            "128 bits, 100 GB/s (AnandTech, Apple Announces M2 SoC, 2022)",
        ),
    ],
};

/// Xclipse 920.
pub(super) const XCLIPSE_920: Machine = Machine {
    name: "xclipse-920",
    help: "Xclipse 920: Exynos 2200 (Galaxy S22), RDNA 2, 2022",
    settings: &[
        known(
            Cores,
            6,
            "Geekbench of a Galaxy S22 Ultra: 3 WGP, so 6 compute units (reameizu.com, 2022)",
        ),
        between(
            TilePx,
            16,
            32,
            64,
            "not published: RDNA 2 renders in bins whose size the driver chooses; 16 to 64",
        ),
        known(
            LineBytes,
            128,
            "of RDNA 2: Linux, amdkfd/kfd_crat.c, vangogh_cache_info",
        ),
        known(
            L1Bytes,
            16 * KIB,
            "of RDNA 2: Linux, amdkfd/kfd_crat.c, vangogh_cache_info. The 128 KiB GL1 between L0 and L2 is not modelled",
        ),
        OPEN_L1_WAYS,
        between(
            L2Bytes,
            512 * KIB,
            1024 * KIB,
            1024 * KIB,
            "not published: 1 MiB in Van Gogh with 8 compute units (Linux, amdkfd/kfd_crat.c), to half that",
        ),
        between(
            L2Ways,
            4,
            16,
            16,
            "not published: 16 in AMD GCN (whitepaper, 2012), down to 4",
        ),
        OPEN_L2_INDEX,
        known(DramDevice, LPDDR5, "Exynos 2200: LPDDR5 (nanoreview.net)"),
        known(
            DramChannels,
            4,
            "Exynos 2200: four channels of 16 bits (nanoreview.net)",
        ),
    ],
};
