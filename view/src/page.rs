//! The files of the page, part of the binary.

/// A file of the page.
pub(crate) struct PageFile {
    pub(crate) path: &'static str,
    pub(crate) kind: &'static str,
    pub(crate) body: &'static [u8],
}

/// A file of the folder `page` under its own name.
macro_rules! file {
    ($path:literal, $kind:expr) => {
        PageFile {
            path: concat!("/", $path),
            kind: $kind,
            body: include_bytes!(concat!("../page/", $path)),
        }
    };
}

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const IMAGE: &str = "image/svg+xml";

/// Every file that is served.
pub(crate) const FILES: [PageFile; 25] = [
    PageFile {
        path: "/",
        kind: HTML,
        body: include_bytes!("../page/index.html"),
    },
    file!("style.css", STYLE),
    file!("icon.svg", IMAGE),
    file!("main.js", SCRIPT),
    file!("link.js", SCRIPT),
    file!("lists.js", SCRIPT),
    file!("samples.js", SCRIPT),
    file!("robot.js", SCRIPT),
    file!("scene.js", SCRIPT),
    file!("plots.js", SCRIPT),
    file!("program.js", SCRIPT),
    file!("pendant.js", SCRIPT),
    file!("readout.js", SCRIPT),
    file!("player.js", SCRIPT),
    file!("colours.js", SCRIPT),
    file!("gamepad.js", SCRIPT),
    file!("header.js", SCRIPT),
    file!("layers.js", SCRIPT),
    file!("measure.js", SCRIPT),
    file!("mesh.js", SCRIPT),
    file!("poses.js", SCRIPT),
    file!("queue.js", SCRIPT),
    file!("tabs.js", SCRIPT),
    file!("world.js", SCRIPT),
    file!("vendor/three.js", SCRIPT),
];

/// The file at a path.
pub(crate) fn at(path: &str) -> Option<&'static PageFile> {
    FILES.iter().find(|file| file.path == path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file that the page needs and nobody serves would show nothing and say little.
    #[test]
    fn every_file_of_the_folder_is_served() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/page");
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.path().is_file() && name != "index.html" {
                assert!(at(&format!("/{name}")).is_some(), "{name} is not served");
            }
        }
        assert!(at("/../Cargo.toml").is_none() && at("/index").is_none());
    }

    /// Modules that are asked for one after the other would open the page late.
    #[test]
    fn every_module_is_asked_for_at_once() {
        let html = std::str::from_utf8(at("/").unwrap().body).unwrap();
        for file in FILES.iter().filter(|file| file.kind == SCRIPT) {
            let link = format!("<link rel=\"modulepreload\" href=\"{}\">", file.path);
            let own = format!("src=\"{}\"", file.path);
            assert!(html.contains(&link) || html.contains(&own), "{}", file.path);
        }
    }

    /// What the policy of the page forbids is not in it.
    #[test]
    fn the_page_has_no_script_or_style_of_its_own() {
        for file in FILES.iter().filter(|file| !file.path.contains("vendor")) {
            let text = std::str::from_utf8(file.body).unwrap();
            for word in [
                " style=\"",
                " onclick=",
                "<script>",
                "eval(",
                "innerHTML",
                "http://",
                "https://",
            ] {
                let allowed = word.starts_with("http") && file.path == "/icon.svg";
                let svg = "http://www.w3.org/2000/svg";
                let count = text.matches(word).count()
                    - text.matches(svg).count().min(text.matches(word).count());
                assert!(allowed || count == 0, "{}: {word}", file.path);
            }
        }
    }
}
