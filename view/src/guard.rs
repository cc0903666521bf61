//! Who may come in.
//!
//! The port is open to every process and every user of this machine, and a browser sends requests
//! of any page to it. So each request is held against five rules before anything is done for it.

use crate::Token;

/// What a visitor may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// See everything, and stop the arm.
    Watch,
    /// Move the arm.
    Hand,
}

/// What of a request is looked at.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Visitor {
    /// `GET`, ...
    pub method: String,
    /// The path, without a query.
    pub path: String,
    /// The header `Host`.
    pub host: Option<String>,
    /// The header `Origin`.
    pub origin: Option<String>,
    /// The header `Sec-Fetch-Site`.
    pub fetch_site: Option<String>,
    /// The header `Sec-WebSocket-Protocol`.
    pub protocols: Option<String>,
    /// Whether it asks for a WebSocket.
    pub upgrades: bool,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Another method than `GET`.
    Method,
    /// Another name of this machine: a page that has bound its own name to our address.
    Host,
    /// A page of another origin.
    Origin,
    /// A request that another site has caused.
    Site,
    /// No token, or a wrong one.
    Token,
}

impl Refusal {
    /// The status of the answer and one sentence.
    #[must_use]
    pub fn answer(self) -> (u16, &'static str) {
        match self {
            Self::Method => (405, "only GET is served here"),
            Self::Host => (
                403,
                "this name of the machine is not served: use 127.0.0.1 or localhost",
            ),
            Self::Origin => (403, "pages of other origins are not served"),
            Self::Site => (403, "requests from other sites are not served"),
            Self::Token => (
                401,
                "the address lacks its token: use the one that canter has printed",
            ),
        }
    }
}

/// The rules.
#[derive(Clone, Debug)]
pub struct Guard {
    /// The port that is served.
    pub port: u16,
    /// Opens the view.
    pub watch: Token,
    /// Opens the view and the pendant.
    pub hand: Token,
}

impl Guard {
    /// Who may be let in to see files of the page: there is no secret in them.
    ///
    /// # Errors
    /// The rule that is broken.
    pub fn admit(&self, visitor: &Visitor) -> Result<(), Refusal> {
        if visitor.method != "GET" {
            return Err(Refusal::Method);
        }
        let host = visitor.host.as_deref().unwrap_or_default();
        if !self.is_ours(host) {
            return Err(Refusal::Host);
        }
        if let Some(origin) = visitor.origin.as_deref()
            && origin.strip_prefix("http://") != Some(host)
        {
            return Err(Refusal::Origin);
        }
        // A person may follow a link to the page itself; nothing else comes from another site.
        let is_visit = visitor.path == "/" && !visitor.upgrades;
        let site = visitor.fetch_site.as_deref();
        if !is_visit && !matches!(site, None | Some("same-origin" | "none")) {
            return Err(Refusal::Site);
        }
        Ok(())
    }

    /// What the visitor of a WebSocket may do. A browser says its origin; whoever has none is no
    /// page and shows the token all the same.
    ///
    /// # Errors
    /// The rule that is broken.
    pub fn admit_socket(&self, visitor: &Visitor) -> Result<Access, Refusal> {
        self.admit(visitor)?;
        let words = visitor.protocols.as_deref().unwrap_or_default().split(',');
        let mut tokens = words.filter_map(|word| word.trim().strip_prefix("token."));
        let word = tokens.next().unwrap_or_default();
        // Both are looked at, so that the time tells nothing.
        match (self.hand.is(word), self.watch.is(word)) {
            (true, _) => Ok(Access::Hand),
            (_, true) => Ok(Access::Watch),
            _ => Err(Refusal::Token),
        }
    }

    fn is_ours(&self, host: &str) -> bool {
        let names = ["127.0.0.1", "localhost", "[::1]"];
        names.iter().any(|name| {
            host.strip_prefix(name)
                .and_then(|rest| rest.strip_prefix(':'))
                == Some(self.port.to_string().as_str())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard() -> Guard {
        Guard {
            port: 8230,
            watch: Token::random().unwrap(),
            hand: Token::random().unwrap(),
        }
    }

    fn visitor(path: &str) -> Visitor {
        Visitor {
            method: "GET".to_owned(),
            path: path.to_owned(),
            host: Some("127.0.0.1:8230".to_owned()),
            ..Visitor::default()
        }
    }

    fn text(word: &str) -> Option<String> {
        Some(word.to_owned())
    }

    #[test]
    fn the_page_is_for_this_machine() {
        let guard = guard();
        for host in ["127.0.0.1:8230", "localhost:8230", "[::1]:8230"] {
            let own = Visitor {
                host: text(host),
                origin: Some(format!("http://{host}")),
                fetch_site: text("same-origin"),
                ..visitor("/main.js")
            };
            assert_eq!(guard.admit(&own), Ok(()));
        }
        for host in [
            "evil.example:8230",
            "127.0.0.1",
            "127.0.0.1:80",
            "localhost.evil:8230",
            "",
        ] {
            let rebound = Visitor {
                host: text(host),
                ..visitor("/")
            };
            assert_eq!(guard.admit(&rebound), Err(Refusal::Host), "{host}");
        }
        let nameless = Visitor {
            host: None,
            ..visitor("/")
        };
        assert_eq!(guard.admit(&nameless), Err(Refusal::Host));
    }

    #[test]
    fn other_pages_are_refused() {
        let guard = guard();
        for origin in [
            "http://127.0.0.1:3000",
            "https://127.0.0.1:8230",
            "null",
            "http://localhost:8230",
        ] {
            let other = Visitor {
                origin: text(origin),
                ..visitor("/main.js")
            };
            assert_eq!(guard.admit(&other), Err(Refusal::Origin), "{origin}");
        }
        for site in ["cross-site", "same-site"] {
            let caused = Visitor {
                fetch_site: text(site),
                ..visitor("/main.js")
            };
            assert_eq!(guard.admit(&caused), Err(Refusal::Site));
            let link = Visitor {
                fetch_site: text(site),
                ..visitor("/")
            };
            assert_eq!(
                guard.admit(&link),
                Ok(()),
                "a link to the page may be followed"
            );
        }
        let post = Visitor {
            method: "POST".to_owned(),
            ..visitor("/")
        };
        assert_eq!(guard.admit(&post), Err(Refusal::Method));
    }

    #[test]
    fn a_socket_needs_a_token() {
        let guard = guard();
        let with = |protocols: Option<String>| Visitor {
            protocols,
            upgrades: true,
            ..visitor("/live")
        };
        let named = |token: &Token| Some(format!("canter, token.{}", token.word()));
        assert_eq!(
            guard.admit_socket(&with(named(&guard.hand))),
            Ok(Access::Hand)
        );
        assert_eq!(
            guard.admit_socket(&with(named(&guard.watch))),
            Ok(Access::Watch)
        );
        for protocols in [
            None,
            text("canter"),
            text("token."),
            text("token.0"),
            named(&Token::random().unwrap()),
        ] {
            assert_eq!(guard.admit_socket(&with(protocols)), Err(Refusal::Token));
        }
        let cross = Visitor {
            fetch_site: text("cross-site"),
            ..with(named(&guard.hand))
        };
        assert_eq!(guard.admit_socket(&cross), Err(Refusal::Site));
        let foreign = Visitor {
            origin: text("http://evil.example"),
            ..with(named(&guard.hand))
        };
        assert_eq!(guard.admit_socket(&foreign), Err(Refusal::Origin));
    }
}
