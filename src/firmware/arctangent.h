/* atan2(y, x) within 3.1 units of the last place, and the same bits on every machine; 0 of (0, 0). */
static float arctangent(float y, float x) {
  const float a = y < 0.0f ? -y : y, b = x < 0.0f ? -x : x, most = a < b ? b : a;
  const float t = most > 0.0f ? (a < b ? a : b) / most : 0.0f;
  /* About 0 or pi / 4, whichever is nearer. */
  const int is_near = t < 0.414213568f;
  const float u = is_near ? t : (t - 1.0f) / (t + 1.0f), z = u * u;
  float out = u + u * (z * (-0.333329469f + z * (0.199776500f + z * (-0.138769746f + z * 0.0805127993f))));
  if (!is_near) out += 0.785398163f;
  if (a > b) out = (1.57079637f - out) - 4.37113900e-8f;
  if (x < 0.0f) out = (3.14159274f - out) - 8.74227801e-8f;
  return y < 0.0f ? -out : out;
}
