#pragma once
// Independent pieces of work on several threads.
#include <cstddef>
#include <functional>

namespace bielle {

// work(0) .. work(count - 1), each once, begun in this order. After an exception nothing more is begun, and the first one is thrown on.
void doInParallel(size_t count, int threads, const std::function<void(size_t)>& work);

}  // namespace bielle
