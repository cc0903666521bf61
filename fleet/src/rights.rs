//! Who may what: the router's rules, made from the names that have certificates.

use std::fmt;
use std::str::FromStr;

use serde_json::{Value, json};

use crate::failure::Failure;

/// The rules that are the same for every fleet.
const TEMPLATE: &str = include_str!("../router.json");

/// What a certificate is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    /// The arms of one cell.
    Cell,
    /// Reads.
    Viewer,
    /// Reads, pauses, stops, resumes, sets the speed.
    Operator,
    /// Reads, sends programs, stops.
    Plant,
}

impl Role {
    /// All of them.
    pub(crate) const ALL: [Self; 4] = [Self::Cell, Self::Viewer, Self::Operator, Self::Plant];

    fn word(self) -> &'static str {
        match self {
            Self::Cell => "cell",
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Plant => "plant",
        }
    }
}

/// Whom a certificate names: `ROLE.NAME`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Holder {
    /// What it is for.
    pub(crate) role: Role,
    /// Who it is.
    pub(crate) name: String,
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.role.word(), self.name)
    }
}

impl FromStr for Holder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected ROLE.NAME (cell, viewer, operator, plant), got {text:?}");
        let (role, name) = text.split_once('.').ok_or_else(wrong)?;
        let role = Role::ALL.into_iter().find(|known| known.word() == role);
        Self::new(role.ok_or_else(wrong)?, name)
    }
}

impl Holder {
    /// Of this role, with a name of letters, digits, `-` and `_`, as cells have.
    ///
    /// # Errors
    /// The name is none, in words.
    pub(crate) fn new(role: Role, name: &str) -> Result<Self, String> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || name.len() > 50 || !name.chars().all(plain) {
            return Err(format!(
                "expected a name of 1 to 50 letters, digits, - and _, got {name:?}"
            ));
        }
        Ok(Self {
            role,
            name: name.to_owned(),
        })
    }
}

/// The configuration of a router at which these may do what their roles allow, and nobody else
/// anything.
///
/// # Errors
/// The shipped rules cannot be read.
pub(crate) fn configuration(holders: &[Holder]) -> Result<Value, Failure> {
    let mut all: Value = serde_json::from_str(TEMPLATE)
        .map_err(|cause| Failure::Unreadable(format!("router.json: {cause}")))?;
    let access = &mut all["access_control"];
    let mut subjects = Vec::new();
    let mut policies = Vec::new();
    let mut rules = access["rules"].as_array().cloned().unwrap_or_default();
    for holder in holders {
        let id = holder.to_string();
        subjects.push(json!({"id": id, "cert_common_names": [id]}));
        let mut own = access["roles"][holder.role.word()].clone();
        if holder.role == Role::Cell {
            let rule = cell_rule(holder, &id);
            if let Some(list) = own.as_array_mut() {
                list.extend(rule.iter().map(|rule| rule["id"].clone()));
            }
            rules.extend(rule);
        }
        policies.push(json!({"rules": own, "subjects": [id]}));
    }
    if let Some(access) = access.as_object_mut() {
        // Not a setting of zenoh.
        access.remove("roles");
        access.insert("rules".to_owned(), Value::Array(rules));
        access.insert("subjects".to_owned(), Value::Array(subjects));
        access.insert("policies".to_owned(), Value::Array(policies));
    }
    Ok(all)
}

/// What a cell alone may say: its own reports, notes and answers.
fn cell_rule(holder: &Holder, id: &str) -> [Value; 3] {
    let of = |word: &str| format!("canter/{}/*/{word}", holder.name);
    let rule = |what: &str, messages: &[&str], names: &[String]| {
        json!({
            "id": format!("{id} {what}"),
            "permission": "allow",
            "flows": ["ingress"],
            "messages": messages,
            "key_exprs": names,
        })
    };
    [
        rule("reports", &["put"], &[of("status"), of("note")]),
        rule("lives", &["liveliness_token"], &[of("alive")]),
        rule("answers", &["declare_queryable", "reply"], &[of("ask/*")]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holders_are_read_as_they_are_shown() {
        for role in Role::ALL {
            let holder = Holder::new(role, "hall-2").unwrap();
            assert_eq!(holder.to_string().parse::<Holder>(), Ok(holder));
        }
        for wrong in [
            "", "cell", "cell.", "boss.x", "cell.a/b", "cell.*", "cell.ä",
        ] {
            assert!(wrong.parse::<Holder>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_policy_has_its_rules() {
        let holders = ["cell.a", "cell.b", "viewer.x", "operator.x", "plant.x"];
        let holders = holders.map(|text| text.parse().unwrap());
        let all = configuration(&holders).unwrap();
        zenoh::Config::from_json5(&all.to_string()).unwrap();
        let access = &all["access_control"];
        assert_eq!(access["default_permission"], "deny");
        assert_eq!(access["enabled"], true);
        let ids: Vec<_> = access["rules"]
            .as_array()
            .unwrap()
            .iter()
            .map(|r| &r["id"])
            .collect();
        let policies = access["policies"].as_array().unwrap();
        assert_eq!(policies.len(), holders.len());
        for policy in policies {
            let rules = policy["rules"].as_array().unwrap();
            assert!(!rules.is_empty());
            assert!(rules.iter().all(|rule| ids.contains(&rule)), "{policy}");
        }
    }

    #[test]
    fn nobody_may_all_names() {
        let all = configuration(&["cell.a".parse().unwrap()]).unwrap();
        for rule in all["access_control"]["rules"].as_array().unwrap() {
            assert_eq!(rule["permission"], "allow");
            for name in rule["key_exprs"].as_array().unwrap() {
                assert!(!name.as_str().unwrap().contains("**"), "{rule}");
            }
        }
    }
}
