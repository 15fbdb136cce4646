//! Pages to look at: one HTML file each, which asks nothing of a network, in light and dark.
//!
//! `environment` holds `base.html` with style, theme and landmarks; a page is a template that
//! extends it and fills its blocks `title`, `style`, `header`, `navigation`, `main`, `footer` and
//! `scripts`. Values are escaped where they are put in. A content security policy forbids what a
//! page should not do.

mod numbers;

use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, Error};
use serde::Serialize;

pub use numbers::{figure, p_value, percent, ratio, share, verdict_words};

/// Renders `template`, which may extend `base.html`, with the values of `context`.
///
/// Beside the filters of Jinja there are [`figure`], [`ratio`], [`percent`], [`share`] and
/// [`p_value`], which show an undefined or infinite value as a dash.
///
/// # Errors
/// Where the template is wrong, or the context can not be serialised.
pub fn render(template: &str, context: impl Serialize) -> Result<String, Error> {
    environment()?.render_str(template, Serde(context))
}

/// JSON that may stand in a `<script>`: no `<` is left in it, which could only be inside of
/// strings.
///
/// # Errors
/// Where the value can not be serialised.
pub fn script_json(value: &impl Serialize) -> serde_json::Result<String> {
    Ok(serde_json::to_string(value)?.replace('<', "\\u003c"))
}

fn environment() -> Result<Environment<'static>, Error> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?;
    environment.set_syntax(syntax);
    environment.add_global("base_style", include_str!("assets/base.css"));
    environment.add_global("base_script", include_str!("assets/base.js"));
    environment.add_filter("figure", |v: &Value| number(v).map_or(DASH.into(), figure));
    environment.add_filter("percent", |v: &Value| number(v).map_or(DASH.into(), percent));
    environment.add_filter("ratio", |v: &Value| number(v).map_or(DASH.into(), ratio));
    environment.add_filter("share", |v: &Value| number(v).map_or(DASH.into(), share));
    environment.add_filter("p_value", |v: &Value| number(v).map_or(DASH.into(), p_value));
    environment.add_template("base.html", include_str!("assets/base.html"))?;
    Ok(environment)
}

const DASH: &str = "—";

fn number(value: &Value) -> Option<f64> {
    f64::try_from(value.clone()).ok().filter(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_extends_the_base_and_escapes_its_values() {
        let template = "{% extends 'base.html' %}{% block main %}<p>{{ name }} {{ v|figure }} {{ w|percent }}</p>{% endblock %}";
        let context = serde_json::json!({ "name": "<script>", "v": 0.5, "w": null });
        let page = render(template, context).unwrap();
        assert!(page.contains("<p>&lt;script&gt; 0.500 —</p>"), "{page}");
        assert!(page.starts_with("<!doctype html>") && page.contains("--accent"));
        assert!(!page.contains("http://") && !page.contains("https://"));
    }

    #[test]
    fn json_for_scripts_can_not_end_the_script() {
        let text = script_json(&"</script><!--").unwrap();
        assert!(!text.contains('<'));
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), "</script><!--");
    }
}
