# Converts headers for Doxygen. The line that follows \file is its description; lines indented by four or more are
# equations and are kept verbatim; < in prose is escaped.
function close_block() { if (inside) print indent "/// ~~~"; inside = 0 }
function escape(text,    parts, count, i, out) {
  count = split(text, parts, "`")
  for (i = 1; i <= count; ++i) {
    if (i % 2) gsub(/<[A-Za-z\/]/, "\\\\&", parts[i])
    out = out (i > 1 ? "`" : "") parts[i]
  }
  return out
}
{
  start = match($0, /\/\/\//)
  is_comment = $0 ~ /^ *\/\/\//
  indent = start ? substr($0, 1, start - 1) : ""
  if (is_comment && $0 ~ /^ *\/\/\/     +[^ ]/) {
    if (!inside) print indent "/// ~~~{.unparsed}"
    inside = 1
    print
    next
  }
  close_block()
  if (is_comment && $0 ~ /\\file [^ ]/) {
    print indent "/// \\file"
    sub(/\\file /, "")
  }
  if (start) $0 = substr($0, 1, start + 3) escape(substr($0, start + 4))
  print
}
END { close_block() }
