#pragma once
namespace bielle {

struct PolynomialEnd {
  double position = 0, velocity = 0, acceleration = 0;
};

// The polynomial of fifth degree between two ends, over t from 0 to its duration.
class Quintic {
 public:
  Quintic(const PolynomialEnd& begin, const PolynomialEnd& end, double duration) : begin_(begin), duration_(duration) {
    const double D = duration,
                 gap = end.position - begin.position - D * begin.velocity - D * D / 2 * begin.acceleration,
                 rate = D * (end.velocity - begin.velocity - D * begin.acceleration),
                 bend = D * D * (end.acceleration - begin.acceleration);
    a_ = 10 * gap - 4 * rate + bend / 2;
    b_ = -15 * gap + 7 * rate - bend;
    c_ = 6 * gap - 3 * rate + bend / 2;
  }

  double calc(double t) const {
    const double s = t / duration_;
    return begin_.position + t * (begin_.velocity + t / 2 * begin_.acceleration) + s * s * s * (a_ + s * (b_ + s * c_));
  }
  double calcAcceleration(double t) const {
    const double s = t / duration_;
    return begin_.acceleration + s * (6 * a_ + s * (12 * b_ + s * 20 * c_)) / (duration_ * duration_);
  }

 private:
  PolynomialEnd begin_;
  double duration_, a_ = 0, b_ = 0, c_ = 0;
};

}  // namespace bielle
