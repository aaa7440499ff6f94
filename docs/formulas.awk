# Converts the formulas of the pages, $`...`$ and ```math blocks, to the syntax of Doxygen.
/^```math *$/ { inside = 1; print "\\f["; next }
inside && /^``` *$/ { inside = 0; print "\\f]"; next }
{
  gsub(/\$`/, "\\f$")
  gsub(/`\$/, "\\f$")
  print
}
