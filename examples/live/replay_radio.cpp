// Simulated SoapySDR radio, driver `replay`: plays `path`, interleaved 16-bit integers of `channels`
// channels at `rate` samples per second, in real time by its own clock. Like a real radio, it
// delivers no samples while it is off, has a start-up time, and loses samples that are not read in
// time. `log` receives the start time of the recording by this computer's clock, and then the
// intervals in which the radio was on.
//
//     g++ -O2 -shared -fPIC -o FOLDER/libreplay.so replay_radio.cpp -lSoapySDR
//     SOAPY_SDR_PLUGIN_PATH=FOLDER SoapySDRUtil --find=driver=replay

#include <SoapySDR/Device.hpp>
#include <SoapySDR/Registry.hpp>

#include <algorithm>
#include <chrono>
#include <complex>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// Time of the radio's clock when it is opened; differs from the computer's time.
constexpr double OPENED_S = 1000.0;
constexpr double STARTS_IN_S = 0.005;
constexpr double BUFFER_S = 0.1;

class Replay : public SoapySDR::Device {
  public:
    explicit Replay(const SoapySDR::Kwargs &told)
        : file(told.at("path"), std::ios::binary), log(told.at("log")),
          rate(std::stod(told.at("rate"))), channels(std::stoul(told.at("channels"))) {
        if (!file) throw std::runtime_error("replay: no file " + told.at("path"));
        const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
        log << std::fixed << Seconds(since_1970).count() << std::endl;
    }

    std::string getDriverKey() const override { return "replay"; }
    size_t getNumChannels(const int direction) const override {
        return direction == SOAPY_SDR_RX ? channels : 0;
    }
    void setSampleRate(const int, const size_t, const double asked) override {
        if (asked != rate) throw std::runtime_error("replay: the recording has another rate");
    }
    void setFrequency(const int, const size_t, const std::string &, const double,
                      const SoapySDR::Kwargs &) override {}
    std::vector<std::string> listFrequencies(const int, const size_t) const override {
        return {"RF"};
    }
    SoapySDR::Stream *setupStream(const int, const std::string &format,
                                  const std::vector<size_t> &asked,
                                  const SoapySDR::Kwargs &) override {
        if (format != "CF32") throw std::runtime_error("replay: CF32 alone");
        if (asked.size() != channels) throw std::runtime_error("replay: all channels at once");
        return reinterpret_cast<SoapySDR::Stream *>(this);
    }
    void closeStream(SoapySDR::Stream *) override { deactivateStream(nullptr, 0, 0); }
    size_t getStreamMTU(SoapySDR::Stream *) const override { return 4096; }

    int activateStream(SoapySDR::Stream *, const int, const long long, const size_t) override {
        began_s = now_s();
        next = static_cast<long long>((began_s + STARTS_IN_S) * rate);
        on = true;
        return 0;
    }
    int deactivateStream(SoapySDR::Stream *, const int, const long long) override {
        if (on) log << began_s << ' ' << now_s() << std::endl;
        on = false;
        return 0;
    }

    int readStream(SoapySDR::Stream *, void *const *buffers, const size_t most, int &flags,
                   long long &time_ns, const long timeout_us) override {
        const auto count = static_cast<long long>(std::min<size_t>(most, 4096));
        const double wait_s = static_cast<double>(next + count) / rate - now_s();
        if (!on || wait_s > 1e-6 * static_cast<double>(timeout_us)) {
            std::this_thread::sleep_for(std::chrono::microseconds(timeout_us));
            return SOAPY_SDR_TIMEOUT;
        }
        std::this_thread::sleep_for(Seconds(wait_s));
        if (wait_s < -BUFFER_S) {
            next = static_cast<long long>(now_s() * rate);
            return SOAPY_SDR_OVERFLOW;
        }
        // No samples after the end of the recording.
        block.assign(static_cast<size_t>(count) * channels * 2, 0);
        file.clear();
        file.seekg(next * static_cast<long long>(channels) * 4);
        file.read(reinterpret_cast<char *>(block.data()), static_cast<std::streamsize>(block.size() * 2));
        for (size_t channel = 0; channel < channels; ++channel) {
            auto *into = static_cast<std::complex<float> *>(buffers[channel]);
            for (size_t k = 0; k < static_cast<size_t>(count); ++k) {
                const auto *sample = &block[2 * (k * channels + channel)];
                into[k] = {static_cast<float>(sample[0]) / 32768.0F,
                           static_cast<float>(sample[1]) / 32768.0F};
            }
        }
        flags = SOAPY_SDR_HAS_TIME;
        time_ns = static_cast<long long>((OPENED_S + static_cast<double>(next) / rate) * 1e9);
        next += count;
        return static_cast<int>(count);
    }

  private:
    double now_s() const { return Seconds(Clock::now() - opened).count(); }

    std::ifstream file;
    std::ofstream log;
    double rate;
    size_t channels;
    Clock::time_point opened = Clock::now();
    double began_s = 0.0;
    long long next = 0;
    bool on = false;
    std::vector<int16_t> block;
};

SoapySDR::KwargsList find(const SoapySDR::Kwargs &told) {
    return told.count("path") ? SoapySDR::KwargsList{told} : SoapySDR::KwargsList{};
}
SoapySDR::Device *make(const SoapySDR::Kwargs &told) { return new Replay(told); }
const SoapySDR::Registry registered("replay", &find, &make, SOAPY_SDR_ABI_VERSION);

} // namespace
