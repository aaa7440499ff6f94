/* sin(x + quarters pi / 2) within 1e-7, and the same bits on every machine; beyond 4096, and of no number, that of x = 0. */
static float sine(float x, int quarters) {
  const float turns = x > -4096.0f && x < 4096.0f ? x * 0.636619772f : 0.0f;
  const int nearest = (int)(turns < 0.0f ? turns - 0.5f : turns + 0.5f), quadrant = nearest + quarters;
  const float n = (float)nearest;
  /* pi / 2 in three parts, of which n times the first two are exact. */
  const float r = turns == 0.0f ? 0.0f : ((x - n * 1.5703125f) - n * 4.83751297e-4f) - n * 7.54979013e-8f;
  const float z = r * r;
  const float y = quadrant & 1 ? 1.0f - z * (0.5f - z * (0.0416666456f + z * (-1.38873130e-3f + z * 2.44327857e-5f)))
                               : r + r * (z * (-0.166666552f + z * (8.33215844e-3f + z * -1.95149580e-4f)));
  return quadrant & 2 ? -y : y;
}
