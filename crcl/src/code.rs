//! The stable names of all kinds of findings.

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $text:literal;)*) => {
        $($(#[$doc])* pub const $name: &str = $text;)*
        /// Every code, for documentation and tests.
        pub const ALL: &[&str] = &[$($name),*];
    };
}

codes! {
    /// The file is not text at all.
    BINARY = "crcl::binary-file";
    /// The file is text, but not in UTF-8.
    NOT_UTF8 = "crcl::not-utf8";
    /// The program has no command.
    EMPTY = "crcl::empty-program";
    /// A character that has no place in a program.
    CHARACTER = "crcl::unexpected-character";
    /// A `/*` without its `*/`.
    COMMENT = "crcl::unterminated-comment";
    /// A text without its closing quote.
    TEXT = "crcl::unterminated-text";
    /// A backslash in a text before a character that it cannot escape.
    ESCAPE = "crcl::bad-escape";
    /// Something that looks like a number and is none.
    NUMBER = "crcl::bad-number";
    /// Not a number, or infinite.
    NOT_FINITE = "crcl::not-finite";
    /// A number too large to be stored.
    OVERFLOW = "crcl::number-overflow";
    /// Something else where a command should begin.
    NOT_A_COMMAND = "crcl::expected-command";
    /// A command without its parentheses.
    PARENTHESES = "crcl::missing-parentheses";
    /// A name that is not a command.
    UNKNOWN_COMMAND = "crcl::unknown-command";
    /// A command that strict mode refuses.
    EXTENSION = "crcl::extension";
    /// A bracket that is never closed.
    UNCLOSED = "crcl::unclosed-bracket";
    /// A bracket of the wrong kind.
    BRACKET = "crcl::wrong-bracket";
    /// A closing bracket that closes nothing.
    SURPLUS_BRACKET = "crcl::surplus-bracket";
    /// Two values with no comma between them.
    COMMA = "crcl::missing-comma";
    /// A comma with no value beside it.
    SURPLUS_COMMA = "crcl::surplus-comma";
    /// Brackets within brackets, deeper than any command needs.
    TOO_DEEP = "crcl::too-deep";
    /// More or fewer arguments than the command takes.
    ARGUMENT_COUNT = "crcl::argument-count";
    /// An argument of the wrong type.
    ARGUMENT_TYPE = "crcl::argument-type";
    /// A list of poses whose stated number is not its length.
    COUNT_MISMATCH = "crcl::count-mismatch";
    /// A list without poses.
    NO_POSES = "crcl::no-poses";
    /// A list of joints that is empty, or has a joint twice or none of that number.
    JOINTS = "crcl::joints";
    /// A setting of a pose that does not exist, or comes twice.
    POSE_SETTING = "crcl::pose-setting";
    /// A screw with too many or too few parts.
    SCREW = "crcl::screw-shape";
    /// A guard that is none.
    GUARD = "crcl::guard";
    /// A pose, point or axis with too many or too few parts.
    POSE_SHAPE = "crcl::pose-shape";
    /// An axis of length zero.
    ZERO_AXIS = "crcl::zero-axis";
    /// A Z axis and an X axis that are not perpendicular.
    NOT_ORTHOGONAL = "crcl::axes-not-orthogonal";
    /// A unit that the language does not know.
    UNKNOWN_UNIT = "crcl::unknown-unit";
    /// A coordinate frame that the language does not know.
    UNKNOWN_FRAME = "crcl::unknown-frame";
    /// A quantity below zero that cannot be.
    NEGATIVE = "crcl::negative-value";
    /// A number larger than the largest that is accepted.
    TOO_LARGE = "crcl::too-large";
    /// A percentage outside 0 to 100.
    PERCENT = "crcl::percent-out-of-range";
    /// A percentage that looks like a fraction.
    FRACTION = "crcl::percent-looks-like-fraction";
    /// Commands before the first InitCanon.
    NO_INIT = "crcl::missing-init-canon";
    /// InitCanon while the robot is ready already.
    SECOND_INIT = "crcl::second-init-canon";
    /// EndCanon with nothing to end.
    NOTHING_TO_END = "crcl::nothing-to-end";
    /// Commands after EndCanon.
    AFTER_END = "crcl::command-after-end-canon";
    /// The program stops without EndCanon.
    NO_END = "crcl::missing-end-canon";
    /// A move while speed or acceleration is set to zero.
    ZERO_SPEED = "crcl::zero-speed";
    /// A gripper command while the tool changer is open.
    NO_TOOL = "crcl::gripper-without-tool";
    /// The tool changer opened while the gripper is closed.
    GRIPPER_CLOSED = "crcl::tool-change-gripper-closed";
    /// A program in default millimetres that looks like metres.
    LOOKS_LIKE_METRES = "crcl::looks-like-metres";
    /// XML that is not well formed.
    XML_SYNTAX = "crcl::xml-syntax";
    /// XML whose root element is not one of CRCL's.
    XML_ROOT = "crcl::xml-root";
    /// XML with an element that does not belong there.
    XML_ELEMENT = "crcl::xml-element";
    /// XML that lacks an element.
    XML_MISSING = "crcl::xml-missing-element";
    /// XML with text where only elements stand.
    XML_TEXT = "crcl::xml-text";
    /// XML with an element of no known kind.
    XML_KIND = "crcl::xml-type";
    /// XML with a value of the wrong type.
    XML_VALUE = "crcl::xml-value";
    /// A share outside 0 to 1.
    FRACTION_RANGE = "crcl::fraction-out-of-range";
    /// XML with something that Canter cannot do yet.
    UNSUPPORTED = "crcl::not-supported";
    /// A command of XML that does nothing in a program from a file.
    NO_EFFECT = "crcl::no-effect";
    /// A block that is repeated without its beginning or its end.
    LOOP = "crcl::loop-block";
    /// A command that the other form of programs cannot say.
    NO_FORM = "crcl::no-such-form";
    /// JSON that is not JSON.
    JSON_SYNTAX = "crcl::json-syntax";
    /// JSON that lacks a field.
    MISSING_FIELD = "crcl::missing-field";
    /// JSON with a field that does not belong there.
    UNKNOWN_FIELD = "crcl::unknown-field";
    /// JSON with the same field twice.
    DUPLICATE_FIELD = "crcl::duplicate-field";
    /// JSON of a schema version that is not ours.
    SCHEMA_VERSION = "crcl::schema-version";
}
