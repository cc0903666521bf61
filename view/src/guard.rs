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
    /// What stands behind the question mark.
    pub query: String,
    /// The header `Host`.
    pub host: Option<String>,
    /// The header `Origin`.
    pub origin: Option<String>,
    /// The header `Sec-Fetch-Site`.
    pub fetch_site: Option<String>,
    /// The header `Sec-WebSocket-Protocol`.
    pub protocols: Option<String>,
    /// The header `Authorization`.
    pub authorization: Option<String>,
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
    /// Opens the live data for viewers of other programs, which may only look. It stands in an
    /// address that others keep and show, so it opens nothing else.
    pub look: Token,
}

/// One rule: what it says of a visitor.
type Rule = fn(&Guard, &Visitor) -> Result<(), Refusal>;

/// The rules that every request must keep, in their order.
const RULES: [Rule; 4] = [
    Guard::check_method,
    Guard::check_host,
    Guard::check_origin,
    Guard::check_site,
];

impl Guard {
    /// Who may be let in to see files of the page: there is no secret in them.
    ///
    /// # Errors
    /// The rule that is broken.
    pub fn admit(&self, visitor: &Visitor) -> Result<(), Refusal> {
        RULES.iter().try_for_each(|rule| rule(self, visitor))
    }

    fn check_method(&self, visitor: &Visitor) -> Result<(), Refusal> {
        keep(visitor.method == "GET", Refusal::Method)
    }

    fn check_host(&self, visitor: &Visitor) -> Result<(), Refusal> {
        let host = visitor.host.as_deref().unwrap_or_default();
        keep(self.is_ours(host), Refusal::Host)
    }

    /// A browser says which page asks; whoever has no origin is no page.
    fn check_origin(&self, visitor: &Visitor) -> Result<(), Refusal> {
        let own = visitor.origin.as_deref().is_none_or(|origin| {
            visitor.host.is_some() && origin.strip_prefix("http://") == visitor.host.as_deref()
        });
        keep(own, Refusal::Origin)
    }

    /// A person may follow a link to the page itself; nothing else comes from another site.
    fn check_site(&self, visitor: &Visitor) -> Result<(), Refusal> {
        let is_visit = visitor.path == "/" && !visitor.upgrades;
        let site = visitor.fetch_site.as_deref();
        let own = matches!(site, None | Some("same-origin" | "none"));
        keep(is_visit || own, Refusal::Site)
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

    /// Who may read what is not of the page itself: whoever shows a token.
    ///
    /// # Errors
    /// The rule that is broken.
    pub fn admit_reader(&self, visitor: &Visitor) -> Result<(), Refusal> {
        self.admit(visitor)?;
        let word = visitor.authorization.as_deref().unwrap_or_default();
        let word = word.strip_prefix("Bearer ").unwrap_or_default();
        // Both are looked at, so that the time tells nothing.
        let (hand, watch) = (self.hand.is(word), self.watch.is(word));
        keep(hand || watch, Refusal::Token)
    }

    /// Who may look on with another program. Such a program, or its page, has another origin, and
    /// that is not held against it: what it gets can move nothing, and the token is asked for.
    ///
    /// # Errors
    /// The rule that is broken.
    pub fn admit_viewer(&self, visitor: &Visitor) -> Result<(), Refusal> {
        self.check_method(visitor)?;
        self.check_host(visitor)?;
        let word = visitor.query.strip_prefix("t=").unwrap_or_default();
        keep(self.look.is(word), Refusal::Token)
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

/// Nothing where a rule is kept, and the refusal otherwise.
fn keep(kept: bool, refusal: Refusal) -> Result<(), Refusal> {
    if kept { Ok(()) } else { Err(refusal) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard() -> Guard {
        Guard {
            port: 8230,
            watch: Token::random().unwrap(),
            hand: Token::random().unwrap(),
            look: Token::random().unwrap(),
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

    /// The token of viewers opens nothing else, and no other token opens their data.
    #[test]
    fn a_viewer_looks_and_no_more() {
        let guard = guard();
        let with = |word: &str| Visitor {
            query: format!("t={word}"),
            origin: text("https://app.foxglove.dev"),
            fetch_site: text("cross-site"),
            ..visitor("/foxglove")
        };
        assert_eq!(guard.admit_viewer(&with(guard.look.word())), Ok(()));
        for wrong in ["", guard.hand.word(), guard.watch.word()] {
            assert_eq!(guard.admit_viewer(&with(wrong)), Err(Refusal::Token));
        }
        let rebound = Visitor {
            host: text("evil.example:8230"),
            ..with(guard.look.word())
        };
        assert_eq!(guard.admit_viewer(&rebound), Err(Refusal::Host));
        let page = Visitor {
            protocols: Some(format!("canter, token.{}", guard.look.word())),
            upgrades: true,
            ..visitor("/live")
        };
        assert_eq!(guard.admit_socket(&page), Err(Refusal::Token));
    }

    #[test]
    fn a_reader_shows_a_token() {
        let guard = guard();
        let with = |authorization: Option<String>| Visitor {
            authorization,
            ..visitor("/mesh/a.stl")
        };
        for token in [&guard.hand, &guard.watch] {
            let shown = with(Some(format!("Bearer {}", token.word())));
            assert_eq!(guard.admit_reader(&shown), Ok(()));
            let foreign = Visitor {
                origin: text("http://evil.example"),
                ..shown
            };
            assert_eq!(guard.admit_reader(&foreign), Err(Refusal::Origin));
        }
        for wrong in [None, text("Bearer "), text(guard.hand.word())] {
            assert_eq!(guard.admit_reader(&with(wrong)), Err(Refusal::Token));
        }
    }

    /// Every rule has a stranger whom only it refuses: with that rule off, he is let in.
    #[test]
    fn no_rule_can_be_left_out() {
        let guard = guard();
        let posting = Visitor {
            method: "POST".to_owned(),
            ..visitor("/main.js")
        };
        // A page that has bound its own name to our address: to its browser it is no other origin.
        let rebound = Visitor {
            host: text("evil.example:8230"),
            origin: text("http://evil.example:8230"),
            fetch_site: text("same-origin"),
            ..visitor("/main.js")
        };
        // A browser too old to tell the site, with a page of another port of this machine.
        let other_port = Visitor {
            origin: text("http://127.0.0.1:3000"),
            ..visitor("/main.js")
        };
        // A picture or script that another site names: browsers send no origin with these.
        let named = Visitor {
            fetch_site: text("cross-site"),
            ..visitor("/main.js")
        };
        for (off, stranger) in [posting, rebound, other_port, named].iter().enumerate() {
            let guarded = |rule: &(usize, Rule)| rule.1(&guard, stranger).is_err();
            let refusing: Vec<usize> = RULES
                .into_iter()
                .enumerate()
                .filter(guarded)
                .map(|(number, _)| number)
                .collect();
            assert_eq!(refusing, [off], "{stranger:?}");
            assert!(guard.admit(stranger).is_err());
        }
        assert_eq!(guard.admit(&visitor("/main.js")), Ok(()));
    }
}
