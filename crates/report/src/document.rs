//! One HTML document that needs nothing else: the look, the plots' library and the scripts that all pages share, in it.

use crate::html::escaped;

const UPLOT_SCRIPT: &str = include_str!("../vendor/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../vendor/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../vendor/LICENSE-uPlot");
const STYLE: &str = include_str!("page/page.css");
/// What every page's scripts build on.
const SHARED_SCRIPTS: [&str; 3] =
    [include_str!("page/format.js"), include_str!("page/theme.js"), include_str!("page/samples.js")];

/// A document.
#[derive(Debug, Clone, Copy)]
pub struct Document<'a> {
    /// Its title, as text.
    pub title: &'a str,
    /// Style beside the pages' own.
    pub style: &'a str,
    /// What stands in its body, as HTML.
    pub body: &'a str,
    /// Its scripts, in their order, behind those that all pages share.
    pub scripts: &'a [&'a str],
    /// What it may connect to, as a content security policy's `connect-src` says it.
    pub connect: &'a str,
}

impl Document<'_> {
    /// The document as HTML. It runs its own scripts, and reaches nothing but what it may connect to.
    pub fn to_html(&self) -> String {
        let Self { style, body, connect, .. } = self;
        let title = escaped(self.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; \
             style-src 'unsafe-inline'; img-src data:; connect-src {connect}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
             <title>{title}</title>\n<style>{UPLOT_STYLE}\n{STYLE}{style}</style>\n</head>\n<body>\n{body}\
             <script>/*! uPlot\n{UPLOT_LICENCE}*/\n{UPLOT_SCRIPT}</script>\n<script>\n\"use strict\";\n"
        );
        SHARED_SCRIPTS.iter().chain(self.scripts).for_each(|script| html.push_str(script));
        html.push_str("</script>\n</body>\n</html>\n");
        html
    }
}
