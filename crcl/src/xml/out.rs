//! Writes elements.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

use super::data::{Guard, JointTolerance, Parameter, PoseTolerance, Quantity};
use crate::guard::GuardLimit;
use crate::pose::Pose;

/// The namespace of `xsi:type`.
const XSI: &str = "http://www.w3.org/2001/XMLSchema-instance";

/// A document that is being written.
pub(super) struct Out {
    writer: Writer<Vec<u8>>,
}

impl Out {
    /// A document with its declaration; with line ends and indents if `spread`.
    pub(super) fn new(spread: bool) -> Self {
        let writer = if spread {
            Writer::new_with_indent(Vec::new(), b' ', 2)
        } else {
            Writer::new(Vec::new())
        };
        let mut out = Self { writer };
        out.event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)));
        out
    }

    /// The whole text.
    pub(super) fn finish(self) -> String {
        // All that was written was text.
        String::from_utf8_lossy(&self.writer.into_inner()).into_owned()
    }

    fn event(&mut self, event: Event) {
        // Memory takes whatever is written to it.
        let _ = self.writer.write_event(event);
    }

    /// The root element around `inside`. No reader may find a `>` before its end.
    pub(super) fn root(&mut self, name: &str, schema: &str, inside: impl FnOnce(&mut Self)) {
        let start = BytesStart::new(name).with_attributes([
            ("xmlns:xsi", XSI),
            ("xsi:noNamespaceSchemaLocation", schema),
        ]);
        self.around(start, inside);
    }

    /// An element around `inside`.
    pub(super) fn element(&mut self, name: &str, inside: impl FnOnce(&mut Self)) {
        self.around(BytesStart::new(name), inside);
    }

    /// An element of a kind, around `inside`.
    pub(super) fn kind(&mut self, name: &str, kind: &str, inside: impl FnOnce(&mut Self)) {
        let kind = format!("{kind}Type");
        let start = BytesStart::new(name).with_attributes([("xsi:type", kind.as_str())]);
        self.around(start, inside);
    }

    fn around(&mut self, start: BytesStart, inside: impl FnOnce(&mut Self)) {
        let name = String::from_utf8_lossy(start.name().as_ref()).into_owned();
        self.event(Event::Start(start));
        inside(self);
        self.event(Event::End(BytesEnd::new(name)));
    }

    /// An element with a value.
    pub(super) fn leaf(&mut self, name: &str, value: &str) {
        // A bare carriage return would be read as a line end.
        let escaped = quick_xml::escape::partial_escape(value).replace('\r', "&#13;");
        self.event(Event::Start(BytesStart::new(name)));
        self.event(Event::Text(BytesText::from_escaped(escaped)));
        self.event(Event::End(BytesEnd::new(name)));
    }

    /// An element with a number, without an exponent: readers of before 2017 know none.
    pub(super) fn number(&mut self, name: &str, value: f64) {
        self.leaf(name, &format!("{}", value + 0.0));
    }

    /// An element with a number, if there is one.
    pub(super) fn maybe_number(&mut self, name: &str, value: Option<f64>) {
        if let Some(value) = value {
            self.number(name, value);
        }
    }

    /// An element with anything that can be shown, if there is one.
    pub(super) fn maybe(&mut self, name: &str, value: Option<impl ToString>) {
        if let Some(value) = value {
            self.leaf(name, &value.to_string());
        }
    }

    /// An element with one of several names.
    pub(super) fn choice<T: PartialEq>(&mut self, name: &str, value: T, names: &[(&str, T)]) {
        if let Some((text, _)) = names.iter().find(|(_, known)| *known == value) {
            self.leaf(name, text);
        }
    }

    /// A point.
    pub(super) fn point(&mut self, name: &str, point: &[f64; 3]) {
        self.three(name, ["X", "Y", "Z"], point);
    }

    /// A direction.
    pub(super) fn vector(&mut self, name: &str, vector: &[f64; 3]) {
        self.three(name, ["I", "J", "K"], vector);
    }

    fn three(&mut self, name: &str, names: [&str; 3], values: &[f64; 3]) {
        self.element(name, |out| {
            for (name, value) in names.iter().zip(values) {
                out.number(name, *value);
            }
        });
    }

    /// What stands inside a pose. One in roll, pitch and yaw has no form in XML; it is never given.
    pub(super) fn pose(&mut self, pose: &Pose) {
        if let Pose::Axes {
            point,
            z_axis,
            x_axis,
        } = pose
        {
            self.point("Point", point);
            self.vector("XAxis", x_axis);
            self.vector("ZAxis", z_axis);
        }
    }

    /// A speed or an acceleration.
    pub(super) fn quantity(&mut self, name: &str, quantity: Quantity) {
        let (kind, part, value) = match quantity {
            Quantity::Absolute(value) => ("Absolute", "Setting", value),
            Quantity::Relative(value) => ("Relative", "Fraction", value),
        };
        self.kind(name, &format!("{name}{kind}"), |out| {
            out.number(part, value);
        });
    }

    /// How near a pose must be reached.
    pub(super) fn tolerance(&mut self, name: &str, tolerance: &PoseTolerance) {
        self.element(name, |out| {
            out.maybe_number("XPointTolerance", tolerance.x);
            out.maybe_number("YPointTolerance", tolerance.y);
            out.maybe_number("ZPointTolerance", tolerance.z);
            out.maybe_number("XAxisTolerance", tolerance.x_axis);
            out.maybe_number("ZAxisTolerance", tolerance.z_axis);
        });
    }

    /// How near joints must come; nothing for an empty list.
    pub(super) fn joint_tolerances(&mut self, name: &str, tolerances: &[JointTolerance]) {
        if tolerances.is_empty() {
            return;
        }
        self.element(name, |out| {
            for tolerance in tolerances {
                out.element("Setting", |out| {
                    out.leaf("JointNumber", &tolerance.joint.to_string());
                    out.number("JointPositionTolerance", tolerance.tolerance);
                });
            }
        });
    }

    /// Names with values.
    pub(super) fn parameters(&mut self, name: &str, parameters: &[Parameter]) {
        for parameter in parameters {
            self.element(name, |out| {
                out.leaf("ParameterName", &parameter.name);
                out.leaf("ParameterValue", &parameter.value);
            });
        }
    }

    /// A condition on a sensor.
    pub(super) fn guard(&mut self, guard: &Guard) {
        self.element("Guard", |out| {
            out.maybe("Name", guard.name.as_ref());
            out.leaf("SensorID", &guard.sensor);
            out.maybe("SubField", guard.field.as_ref());
            out.choice("LimitType", guard.kind, GuardLimit::NAMES);
            out.number("LimitValue", guard.limit);
            out.maybe("RecheckTimeMicroSeconds", guard.recheck_us);
            out.maybe("CheckCount", guard.check_count);
            out.maybe("LastCheckTime", guard.last_check_ms);
            out.maybe_number("LastCheckValue", guard.last_check_value);
            out.maybe("RequireTrigger", guard.require_trigger);
            out.maybe("ErrorOnTrigger", guard.error_on_trigger);
        });
    }
}
