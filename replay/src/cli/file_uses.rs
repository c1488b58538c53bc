//! Files that the commands read and write.

use shell::{FileUse, FileUses};

/// Uses of the arguments of `replay`; a test compares the table with the command line.
pub const FILES: &FileUses = &[
    (&["report", "paper"], &["images"], FileUse::Input),
    (&["view"], &["image"], FileUse::Input),
    (&["techniques"], &["folders"], FileUse::InputFolder),
    (&["accuracy"], &["techniques"], FileUse::InputFolder),
    (&["locality"], &["csv"], FileUse::Folder),
    (&["accuracy"], &["output"], FileUse::Folder),
    (&["man"], &["folder"], FileUse::Folder),
    (&[], &["out"], FileUse::Folder),
    (&["sample"], &["keep"], FileUse::Folder),
    (&["sample"], &["values"], FileUse::Input),
    (&["sample"], &["save_values"], FileUse::Output),
    (&["sample"], &["command"], FileUse::NoFile),
    (&["sample", "predict"], &["baseline"], FileUse::NoFile),
    (&["predict"], &["to"], FileUse::NoFile),
    (&["sweep"], &["inputs"], FileUse::Input),
    (&["sweep"], &["vary"], FileUse::NoFile),
    (&["schedule"], &["schedulers"], FileUse::NoFile),
    (&[], &["save_orders"], FileUse::FolderOfNewNames),
    (
        &[],
        &[
            "trace",
            "traces",
            "truth",
            "capture",
            "rays",
            "seconds",
            "traversal",
            "a",
            "b",
            "left",
            "right",
            "files",
            "config",
            "addresses",
            "order_files",
        ],
        FileUse::Input,
    ),
    (
        &[],
        &[
            "output", "csv", "html", "image", "parquet", "path", "timeline", "picture",
        ],
        FileUse::Output,
    ),
    (
        &[],
        &[
            "orders",
            "caches",
            "between",
            "search",
            "learn",
            "tries",
            "held_out",
            "calibrate",
            "stand_ins",
            "paper_scenes",
        ],
        FileUse::NoFile,
    ),
];
