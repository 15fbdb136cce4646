//! The command as its users meet it: the built binary with arguments, files and signals.

#[path = "cli/agree.rs"]
mod agree;
#[path = "cli/bad_use.rs"]
mod bad_use;
#[path = "cli/checkpoint.rs"]
mod checkpoint;
#[path = "cli/compare.rs"]
mod compare;
#[path = "cli/experiment.rs"]
mod experiment;
#[path = "cli/look.rs"]
mod look;
#[path = "cli/merge.rs"]
mod merge;
#[path = "cli/new_plugin.rs"]
mod new_plugin;
#[path = "cli/render.rs"]
mod render;
#[path = "cli/report.rs"]
mod report;
#[path = "cli/scenes.rs"]
mod scenes;
#[path = "cli/support.rs"]
mod support;
#[path = "cli/tev.rs"]
mod tev;
#[path = "cli/until_error.rs"]
mod until_error;
#[path = "cli/validate.rs"]
mod validate;
