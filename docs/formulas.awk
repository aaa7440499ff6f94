# Formulas of the pages, $`...`$ and blocks of ```math, as Doxygen writes them.
/^```math *$/ { inside = 1; print "\\f["; next }
inside && /^``` *$/ { inside = 0; print "\\f]"; next }
{
  gsub(/\$`/, "\\f$")
  gsub(/`\$/, "\\f$")
  print
}
