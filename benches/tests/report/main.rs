//! The report page.

mod browser;
mod chromium;
mod page;
mod sample;
