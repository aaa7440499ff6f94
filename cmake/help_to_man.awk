# The help of a command as a manual page. Variables: name, command, version, related (names of other pages).
function escape(text) {
  gsub(/\\/, "\\e", text)
  gsub(/-/, "\\-", text)
  if (text ~ /^[.']/) text = "\\&" text
  return text
}
function section(title) { print ".SH " toupper(title) }
function begin_verbatim() { if (!verbatim) print ".nf"; verbatim = 1 }
function end_verbatim() { if (verbatim) print ".fi"; verbatim = 0 }

BEGIN { state = "description" }
state == "description" && /^Usage:/ {
  printf ".TH %s 1 \"\" \"bielle %s\" \"Bielle\"\n", toupper(escape(name)), version
  print ".ad l\n.nh"
  section("name")
  sub(/\.$/, "", summary)
  print escape(name) " \\- " escape(summary)
  section("synopsis")
  sub(/^Usage: */, "")
  sub(/^[^ ]+( [a-z][-a-z]*)*/, command)
  print ".B " escape($0)
  state = "usage"
  next
}
state == "description" { if ($0 != "") summary = summary (summary == "" ? "" : " ") $0; next }
/^(Positionals|Options|Subcommands|Examples):$/ || /^\[Option Group: / {
  end_verbatim()
  sub(/:$/, "")
  section($0 == "Subcommands" ? "Commands" : $0 == "Positionals" ? "Arguments" : $0)
  state = $0 == "Examples" ? "text" : "list"
  if (state == "text") begin_verbatim()
  next
}
state != "text" && /^$/ { next }
state == "list" && /^  [^ ]/ {
  line = $0
  sub(/^  /, "", line)
  explained = ""
  # The name ends where two blanks begin, or at the last column before the explanations.
  if (match(line, /  +/)) { explained = substr(line, RSTART + RLENGTH); line = substr(line, 1, RSTART - 1) }
  else if (length($0) > 30 && substr($0, 30, 1) == " ") { explained = substr($0, 31); line = substr($0, 3, 27) }
  print ".TP"
  print ".B " escape(line)
  if (explained != "") print escape(explained)
  next
}
state == "list" && /^ / { sub(/^ +/, ""); print escape($0); next }
{
  if (state != "text") { section("details"); state = "text" }
  begin_verbatim()
  print escape($0)
}
END {
  end_verbatim()
  if (related != "") {
    section("see also")
    count = split(related, pages, " ")
    for (i = 1; i <= count; ++i) printf ".BR %s (1)%s\n", escape(pages[i]), i < count ? "," : ""
  }
}
