# SPDX-License-Identifier: Apache-2.0
"""JSON, good and bad, by RFC 8259. `values()` stand where a value may; `messages()` are whole texts.

What RFC 8259 leaves to the reader is decided so (src/json/reading/reader.hpp): a number beyond the range of a
double is refused, of any size and precision below it is accepted; half a surrogate pair is refused; names may
be there twice, but not those of the codec; 64 levels are the limit.
"""
import json

from cases import invalid_texts, valid_texts

VALID, INVALID, NOT_UTF8, PLAIN = "valid", "invalid", "not UTF-8", "plain"
depth_max = 64

valid_numbers = """0 -0 1 -1 9 10 12 123456789 0.0 -0.0 0.1 -0.1 1.0 1.5 -1.5 0.5e1 1e0 1E0 1e1 1E1 1e+1
    1E+1 1e-1 1E-1 1e01 1e-01 1e00001 0e0 0E+1 0e400 0.0e999999 -0e-400 1.25e2 1e22 1e23 1e100 -1e100 1e308
    1.7976931348623157e308 -1.7976931348623157e308 1.7976931348623158e308 2.2250738585072014e-308
    2.2250738585072011e-308 5e-324 4.9406564584124654e-324 2e-324 1e-400 -1e-400 1e-999999999999999999999
    9007199254740991 9007199254740992 9007199254740993 -9007199254740993 2147483648 4294967296
    9223372036854775807 9223372036854775808 -9223372036854775808 -9223372036854775809 18446744073709551615
    18446744073709551616 18446744073709551617 123456789012345678901234567890 100000000000000000000
    0.1000000000000000055511151231257827 3.141592653589793238462643383279502884197
    1.0000000000000000000000000000000000000000000000001 123.456e-789""".split() + [
        "1" * 309, "-" + "1" * 309, "1" + "0" * 308, "0." + "0" * 400 + "1", "0." + "1" * 1000,
        "1." + "0" * 1000, "1" * 300 + "." + "1" * 300, "1" + "0" * 400 + "e-400", "0." + "0" * 400 + "1e400"]

invalid_numbers = """+ - -- +1 ++1 -+1 --1 +0 01 -01 00 -00 007 1. -1. 0. .5 -.5 . -. 1.e1 .e1 1e 1E 1e+ 1e-
    1ee1 1e1.5 1e1e1 1.2.3 1..2 0x10 0X1F 0b1 0o7 0x 1_000 1'000 1,000 1f 1L 1d 1u 1n 1a a1 1- 1+1 1-1 1*2
    1/2 1% $1 NaN -NaN +NaN nan NAN Infinity -Infinity +Infinity infinity inf -inf INF 1.#INF 1.#QNAN \u221e
    \u0661 \uff11 \u00b2 \u00bd 1e400 -1e400 1e309 1.8e308 -1.8e308 1.7976931348623159e308 1e999999
    1e99999999999999999999""".split() + [
        "- 1", "1 000", "1 e1", "1e 1", "1 .0", "1. 0", "1" + "0" * 309, "-1" + "0" * 309, "9" * 309,
        "0." + "0" * 400 + "1e800", "1e" + "9" * 400]

valid_words = ["null", "true", "false"]
invalid_words = """True TRUE FALSE False Null NULL nul nulll n tru truee t fals falsee f undefined None nil
    yes no on off void nullnull truefalse abc null1 true_ .null -true @ ! ? * & ^ ~ ` ; = | \\ \\n $ % # < >
    <a/> (1) 'a'""".split() + [
        "nu ll", "t rue", "null null", "true false", "not null"]

valid_strings = [
    '""', '" "', '"a"', '"\\""', '"\\\\"', '"\\/"', '"/"', '"\\b\\f\\n\\r\\t"', '"\\u0000"',
    '"\\u0001\\u001f"', '"\\u0022\\u005c"', '"\\u007f"', '"\x7f"', '"\\u00e9"', '"\\u00E9"', '"\\u20ac"',
    '"\\uFFFF"', '"\\ufffe"', '"\\ud83e\\udd16"', '"\\uD83E\\uDD16"', '"\\ud800\\udc00"', '"\\udbff\\udfff"',
    '"x\\ud83e\\udd16y\\ud83e\\udd16"', '"\\\\u0041"', '"\\\\\\""', '"\\\\\\\\"', '"\\u2028\\u2029"',
    '"\u2028\u2029"', '"\u00a0"', '"// no comment"', '"/* nor this */"', '"[{,:}]"', '"\'"', '"{\\"a\\":1}"',
    '"null"', '"1e400"', '"NaN"', '"\\u0061\\u0301"',
    '"' + "".join(chr(c) for c in range(0x20, 0x7f) if chr(c) not in '"\\') + '"', '"' + "x" * 5000 + '"',
    '"' + "\\n" * 1000 + '"', '"' + "\\\\" * 1001 + '"', '"' + "\u20ac" * 1000 + '"',
    '"' + "\\u20ac" * 1000 + '"'
] + ['"' + text.decode() + '"' for text in valid_texts if not any(byte < 0x20 for byte in text)] + [
    f'"{"y" * size}"' for size in (*range(1, 10), 15, 16, 17, 31, 32, 33, 63, 64, 65, 127, 128, 129)] + [
    '"' + "z" * size + '\\"' + '"' for size in (14, 15, 30, 31, 62, 63, 64)]

invalid_strings = [
    '"', '"a', '"a\\"', '"\\"', '"\\\\\\"', 'a"', '"a"b', '"a""b"', '"a" "b"', "'a'", "'a\"", "\"a'", '`a`',
    "\u201ca\u201d", '"\\', '"\\ "', '"\\a"', '"\\v"', '"\\0"', '"\\1"', '"\\x41"', '"\\\'"', '"\\N"',
    '"\\B"', '"\\e"', '"\\$"', '"\\\u00e9"', '"\\\n"', '"\\u"', '"\\u1"', '"\\u12"', '"\\u123"', '"\\u123g"',
    '"\\ug123"', '"\\u 123"', '"\\u+123"', '"\\u-123"', '"\\u{41}"', '"\\U0041"', '"\\u00g0"',
    '"\\uFF\u0661\u0661"', '"\\u0x41"', '"\\u', '"\\u00', '"a\\u12"b"', '"\\ud800"', '"\\udbff"',
    '"\\udc00"', '"\\udfff"', '"\\uD800x"', '"\\ud800\\n"', '"\\ud800\\u0041"', '"\\ud800\\ud800"',
    '"\\udc00\\ud800"', '"\\ud83e\\\\udd16"', '"\\ud83e \\udd16"', '"\\ud83e\\udd1"', '"\\ud83e\\u"',
    '"\\ud83e\\"', '"\\ud83e\\ud83e\\udd16"', '"\\ud83e\\udd16\\udd16"'
] + [f'"a{chr(c)}b"' for c in range(0x20)]

valid_structures = [
    "[]", "{}", "[ ]", "{ }", "[\t\n\r ]", "{\t\n\r }", "[0]", "[[]]", "[{}]", '{"a":[]}', '{"a":{}}',
    "[[],[]]", "[1,2,3]", "[ 1 , 2 , 3 ]", "[1\n,\t2\r\n,3]", '[null,true,false,"",0,[],{}]', '{"a":1}',
    '{"a":1,"b":2}', '{ "a" : 1 , "b" : 2 }', '{\n\t"a"\r\n:\n1\n}', '{"":0}', '{"a":null}', '{"\\u0061":1}',
    '{"\\"":1}', '{"\\\\":1}', '{"\u20ac":1}', '{"\\u0000":1}', '{"a b":1}',
    '{"__proto__":1,"constructor":2,"toString":3}',
    '{"op":"publish","topic":"/t","msg":{},"id":1,"service":2,"message_id":3,"in_reply_to":4}',
    '{"a":1,"a":2}', '{"a":1,"a":1}', '{"a":{},"a":[]}', '{"a":1,"\\u0061":2}', '{"":1,"":2}',
    '{"a":{"b":{"c":[1,{"d":[[[]]]}]}}}', "[" + ",".join(["0"] * 2000) + "]",
    "[" + ",".join(["[]"] * 1000) + "]", "{" + ",".join(f'"{n}":{n}' for n in range(500)) + "}", " 1 ",
    "\n\"a\"\t", "\r\n[]\r\n", " " * 3000 + "1", "[1" + " " * 3000 + "]"]

invalid_structures = [
    "", " ", "\n", ",", ":", "[", "]", "{", "}", "[}", "{]", "[1}", '{"a":1]', "[[]", "[]]", "[[[]]", "{{}}",
    "{}}", "}{", "][", "[]{}", "{} {}", "[] []", "[,]", "[,1]", "[1,]", "[1,,2]", "[,,]", "[1 2]", "[1;2]",
    "[1:2]", "[1]2", "[1", "[1,", '["a"', '["a",', '["a', "[\"a]", "[null", "[n]", "[nul]", "[truefalse]",
    "[-]", "[+1]", "[01]", "[1.]", "[.1]", "[*]", "{,}", '{,"a":1}', '{"a":1,}', '{"a":1,,"b":2}',
    '{"a":1;"b":2}', '{"a" 1}', '{"a"::1}', '{"a":1:2}', '{"a"}', '{"a":}', '{"a",1}', '{"a":,"b":1}',
    '{"a"', '{"a":', '{"a":1', '{"a":1,', '{"a":1 "b":2}', '{"a":1 2}', '{"a":"b"c}', "{a:1}", "{'a':1}",
    "{1:2}", "{null:1}", "{true:1}", "{[]:1}", "{{}:1}", '{"a":a}', '{"a":\'b\'}', '{"a"=1}', '{"a"=>1}',
    '{:1}', '{"a\n":1}', '{"\\x":1}', '{"\\ud800":1}', "{\"a\":1}}", '{"a":[}', '{"a":{]}', "//\n1", "1//",
    "/**/1", "1/**/", "[1/**/]", "[1,//\n2]", '{/**/"a":1}', "#\n1", "--1", "<!-- -->1", "\f1", "1\f", "\v1",
    "1\v", "\b1", "\x001", "1\x00", "\x001\x00", "[\x00]", "[1,\x002]", "\x1f1", "\x7f1", "\x851", "\u00a01",
    "1\u00a0", "\u20031", "\u20281", "1\u2029", "\ufeff1", "\ufeff[]", "1\ufeff", "\u200b1", "\u180e1",
    "[\u00a0]", "[1\u20282]", "1 1", "1,", "1]", "1 x", "1;", '"a"x', '"a",', "[] x", "{} x", "true 1",
    "null,", "\\u0031", "\\n1", "\\", "\\u005b]", "[\\n]", "function(){}", "new Date()", "1+1", "a.b",
    "a[0]", "...", "@x", "!!1", "&a 1", "*a", "- 1\n- 2", "a: 1", "|", ">", "---\n1", "%YAML", "b'a'",
    "u'a'", "r\"a\"", "(1,2)", "{1,2}", "[1,2)", "<1>", "=1", "1=1"]


def nested(levels, opening, closing):
    return opening * levels + closing * levels


def deep(levels):
    """Texts with so many levels, of all kinds."""
    yield nested(levels, "[", "]")
    yield '{"a":' * (levels - 1) + "{}" + "}" * (levels - 1)
    yield '[{"a":' * (levels // 2) + ("[]" if levels % 2 else "1") + "}]" * (levels // 2)
    yield "[1," * (levels - 1) + "[2]" + ",3]" * (levels - 1)
    yield "[[]," * (levels - 1) + "[]" + "]" * (levels - 1)


def values(outside):
    """(verdict, text) of what may stand as a value inside `outside` levels."""
    for text in (*valid_numbers, *valid_words, *valid_strings, *valid_structures):
        yield VALID, text.encode()
    for number in valid_numbers:
        yield VALID, f"[{number}, {number} ]".encode()
    for text in (*invalid_numbers, *invalid_words, *invalid_strings, *invalid_structures):
        yield INVALID, text.encode()
    for number in invalid_numbers[:60]:
        yield INVALID, f"[0,{number}]".encode()
    for text in invalid_texts:
        yield NOT_UTF8, b'"' + text + b'"'
        yield NOT_UTF8, text
    for levels in (1, 2, 10, depth_max - outside - 1, depth_max - outside):
        for text in deep(levels):
            yield VALID, text.encode()
    for levels in (depth_max - outside + 1, depth_max - outside + 2, 100, 1000, 5000):
        for text in deep(levels):
            yield INVALID, text.encode()
    for opening in ("[", '{"a":', "[{\"a\":", "[1,"):
        yield INVALID, opening.encode() * 5000
    yield INVALID, nested(10000, "[", "]").encode()


def messages(publish):
    """(verdict, text) of whole texts; `publish` is a valid one. INVALID are all that must be refused. PLAIN
    is JSON without an `op`: a plain message, for nobody here, and no error."""
    text = json.dumps(publish)
    whole = text.encode()
    for end in range(len(whole)):
        yield INVALID, whole[:end]
    for begin in range(1, len(whole)):
        yield INVALID, whole[begin:]
    for garbage in ("x", ",", ":", "]", "}", "{", "[", '"', "1", "null", "{}", "[]", "\x00", "\ufeff", "//",
                    "/**/", "\f",
                    "\u00a0", ";", text, "\n" + text, "," + text):
        yield INVALID, whole + garbage.encode()
        if garbage != text and garbage != "\n" + text:
            yield INVALID, garbage.encode() + whole
    for blank in (" ", "\t", "\n", "\r", "\r\n \t", " " * 1000):
        yield INVALID, blank.encode()
        yield VALID, blank.encode() + whole
        yield VALID, whole + blank.encode()
    for other in ("{}", '{"a":1}', '{"msg":{}}', f'{{"a":{text}}}'):
        yield PLAIN, other.encode()
    for other in ("null", "true", "false", "0", "-1.5", '""', '"publish"', "[]", "[{}]", f"[{text}]",
                  json.dumps(text)):
        yield INVALID, other.encode()
    for indent in (0, 1, "\t"):
        yield VALID, json.dumps(publish, indent=indent).encode()
    for names in (reversed(publish), sorted(publish)):
        yield VALID, json.dumps({name: publish[name] for name in names}).encode()
    yield VALID, json.dumps({**publish, "unknown": [1, {"msg": 2}], "": 0}).encode()
    yield VALID, whole.replace(b'"op"', b'"\\u006fp"').replace(b'"topic"', b'"t\\u006Fpic"')
    yield VALID, whole.replace(b'"publish"', b'"pub\\u006cish"').replace(b'"/t"', b'"\\/t"')
    for name in publish:  # a name of the codec twice, in all spellings
        again = f'"{name}":{json.dumps(publish[name])}'
        escaped = again.replace(name[0], f"\\u{ord(name[0]):04x}", 1)
        for more in (again, escaped):
            yield INVALID, whole[:-1] + b"," + more.encode() + b"}"
            yield INVALID, b"{" + more.encode() + b"," + whole[1:]
    for name in ("op", "topic", "msg"):
        without = {other: value for other, value in publish.items() if other != name}
        yield PLAIN if name == "op" else INVALID, json.dumps(without).encode()
        for wrong in (None, True, False, 0, 1.5, [], [1], *([] if name == "msg" else [{}, ""]),
                      *(["x"] if name == "msg" else [])):
            yield INVALID, json.dumps({**without, name: wrong}).encode()
    for op in ("Publish", "publish ", "pub", "publish\0"):
        yield INVALID, json.dumps({**publish, "op": op}).encode()
    for id_of in (True, [], {}, 1.5):
        yield INVALID, json.dumps({**publish, "id": id_of}).encode()
    for id_of in (None, "", "x", 0, -1, 2**53, "\u20ac"):
        yield VALID, json.dumps({**publish, "id": id_of}).encode()
    for depth in (depth_max - 2, depth_max - 1):
        verdict = VALID if depth < depth_max - 1 else INVALID
        deeper = f'"msg": {{"deep": {nested(depth, "[", "]")}, '
        yield verdict, whole.replace(b'"msg": {', deeper.encode())
