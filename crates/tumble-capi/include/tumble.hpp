/**
 * Tumble for firmware in C++17: classes over tumble.h, which describes each call, its units and its errors.
 *
 * All is inline; nothing takes heap, throws or needs run-time type information. An object owns the storage of its state and
 * is neither copied nor moved, so that a state has one owner. Its constructor initialises the storage, whose status is
 * status(); its destructor clears it, so that a later use is answered by ::TUMBLE_ERROR_NOT_INITIALISED.
 */
#ifndef TUMBLE_HPP
#define TUMBLE_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "tumble.h"

namespace tumble {

/** Values that follow each other, which somebody else owns: an array, std::array, std::vector or std::span. */
template <typename T>
class span {
public:
    constexpr span() noexcept = default;

    constexpr span(T *first, std::size_t count) noexcept : data_(first), size_(count) {}

    template <std::size_t count>
    constexpr span(T (&values)[count]) noexcept : data_(values), size_(count)
    {
    }

    template <typename Values, typename = std::enable_if_t<std::is_convertible_v<
                                   std::remove_pointer_t<decltype(std::declval<Values &>().data())> (*)[], T (*)[]>>>
    constexpr span(Values &values) noexcept : data_(values.data()), size_(values.size())
    {
    }

    template <typename Values,
              typename = std::enable_if_t<std::is_const_v<T> && !std::is_lvalue_reference_v<Values>>,
              typename = decltype(std::declval<const Values &>().data())>
    constexpr span(Values &&values) noexcept : data_(values.data()), size_(values.size())
    {
    }

    constexpr T *data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr T *begin() const noexcept { return data_; }
    constexpr T *end() const noexcept { return data_ + size_; }
    constexpr T &operator[](std::size_t place) const noexcept { return data_[place]; }

    /** The first values, at most as many as there are. */
    constexpr span first(std::size_t count) const noexcept { return {data_, count < size_ ? count : size_}; }

private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};

/** A value, or the status that names the reason why there is none. */
template <typename T>
class [[nodiscard]] result {
public:
    result(tumble_status status, const T &value) noexcept : status_(status), value_(value) {}

    explicit operator bool() const noexcept { return status_ == TUMBLE_OK; }
    tumble_status status() const noexcept { return status_; }

    /** The value; without meaning unless the status is ::TUMBLE_OK. */
    const T &operator*() const noexcept { return value_; }
    const T *operator->() const noexcept { return &value_; }

    /** The value, or another where there is none. */
    T value_or(const T &other) const noexcept { return status_ == TUMBLE_OK ? value_ : other; }

private:
    tumble_status status_;
    T value_;
};

/** True if header and library belong together: the first check of a program. */
[[nodiscard]] inline bool is_compatible() noexcept
{
    return tumble_abi() == TUMBLE_ABI && std::strcmp(tumble_version(), TUMBLE_VERSION) == 0;
}

namespace detail {

/** Calls `call` with room for a value. */
template <typename T, typename Call>
result<T> answered(Call call) noexcept
{
    T value{};
    const tumble_status status = call(&value);
    return {status, value};
}

/** Storage of a state, cleared when it ends. */
template <typename State>
class owner {
public:
    owner(const owner &) = delete;
    owner &operator=(const owner &) = delete;

    /** Outcome of the constructor. */
    [[nodiscard]] tumble_status status() const noexcept { return status_; }
    explicit operator bool() const noexcept { return status_ == TUMBLE_OK; }

    /** State as calls of C take it. */
    State *get() noexcept { return &state_; }
    const State *get() const noexcept { return &state_; }

protected:
    owner() noexcept = default;
    ~owner()
    {
        for (auto &word : state_.words) {
            // A write that a compiler may not leave out, although nobody reads it in the life of the object.
            *const_cast<volatile std::uint64_t *>(&word) = 0;
        }
    }

    State state_{};
    tumble_status status_ = TUMBLE_ERROR_NOT_INITIALISED;
};

} // namespace detail

/**
 * Callbacks of flash, by an object that outlives the store: `Driver` has `read(address, span<std::uint8_t>)`,
 * `write(address, span<const std::uint8_t>)` and `erase(address)`, which return true on success and are noexcept, and `page`.
 */
template <typename Driver>
tumble_flash flash_of(Driver &driver) noexcept
{
    static_assert(noexcept(driver.read(0, span<std::uint8_t>())) && noexcept(driver.erase(0)) &&
                      noexcept(driver.write(0, span<const std::uint8_t>())),
                  "an exception may not pass through the library");
    tumble_flash flash{};
    flash.context = &driver;
    flash.read = [](void *context, std::uint32_t address, std::uint8_t *bytes, std::uint32_t length) noexcept -> int {
        return static_cast<Driver *>(context)->read(address, span<std::uint8_t>(bytes, length)) ? 0 : -1;
    };
    flash.write = [](void *context, std::uint32_t address, const std::uint8_t *bytes,
                     std::uint32_t length) noexcept -> int {
        return static_cast<Driver *>(context)->write(address, span<const std::uint8_t>(bytes, length)) ? 0 : -1;
    };
    flash.erase = [](void *context, std::uint32_t address) noexcept -> int {
        return static_cast<Driver *>(context)->erase(address) ? 0 : -1;
    };
    flash.page = Driver::page;
    return flash;
}

/** Records in flash. */
class store : public detail::owner<tumble_store> {
public:
    store(const tumble_flash &flash, std::uint32_t start, std::uint32_t length,
          const tumble_write_limit *limit = nullptr) noexcept
    {
        status_ = tumble_store_init(&state_, sizeof state_, &flash, start, length, limit);
    }

    result<std::uint32_t> entries() const noexcept
    {
        return detail::answered<std::uint32_t>(
            [this](std::uint32_t *entries) { return tumble_store_get_entries(&state_, entries); });
    }

    result<tumble_record> load(std::uint64_t identity, tumble_sensor sensor,
                               tumble_which which = TUMBLE_WHICH_IN_FORCE) noexcept
    {
        return detail::answered<tumble_record>(
            [&](tumble_record *record) { return tumble_store_load(&state_, identity, sensor, which, record); });
    }

    [[nodiscard]] tumble_status save(std::uint64_t now, const tumble_record &record,
                                     std::uint64_t *wait = nullptr) noexcept
    {
        return tumble_store_save(&state_, now, &record, wait);
    }

    [[nodiscard]] tumble_status save_factory(std::uint64_t now, const tumble_record &record,
                                             std::uint64_t *wait = nullptr) noexcept
    {
        return tumble_store_save_factory(&state_, now, &record, wait);
    }

    result<tumble_record> roll_back(std::uint64_t now, std::uint64_t identity, tumble_sensor sensor, tumble_which to,
                                    std::uint64_t *wait = nullptr) noexcept
    {
        return detail::answered<tumble_record>([&](tumble_record *record) {
            return tumble_store_roll_back(&state_, now, identity, sensor, to, record, wait);
        });
    }

    result<tumble_temperature_drift> load_drift(std::uint64_t identity, tumble_sensor sensor) noexcept
    {
        return detail::answered<tumble_temperature_drift>([&](tumble_temperature_drift *drift) {
            return tumble_store_load_drift(&state_, identity, sensor, drift);
        });
    }

    [[nodiscard]] tumble_status save_drift(std::uint64_t now, const tumble_drift_record &drift,
                                           std::uint64_t *wait = nullptr) noexcept
    {
        return tumble_store_save_drift(&state_, now, &drift, wait);
    }

    result<tumble_magnetometer_record> load_magnetometer(std::uint64_t identity,
                                                         tumble_which which = TUMBLE_WHICH_IN_FORCE) noexcept
    {
        return detail::answered<tumble_magnetometer_record>([&](tumble_magnetometer_record *record) {
            return tumble_store_load_magnetometer(&state_, identity, which, record);
        });
    }

    [[nodiscard]] tumble_status save_magnetometer(std::uint64_t now, const tumble_magnetometer_record &record,
                                                  std::uint64_t *wait = nullptr) noexcept
    {
        return tumble_store_save_magnetometer(&state_, now, &record, wait);
    }

    [[nodiscard]] tumble_status save_factory_magnetometer(std::uint64_t now, const tumble_magnetometer_record &record,
                                                          std::uint64_t *wait = nullptr) noexcept
    {
        return tumble_store_save_factory_magnetometer(&state_, now, &record, wait);
    }

    result<tumble_magnetometer_record> roll_back_magnetometer(std::uint64_t now, std::uint64_t identity, tumble_which to,
                                                              std::uint64_t *wait = nullptr) noexcept
    {
        return detail::answered<tumble_magnetometer_record>([&](tumble_magnetometer_record *record) {
            return tumble_store_roll_back_magnetometer(&state_, now, identity, to, record, wait);
        });
    }

    [[nodiscard]] tumble_status erase() noexcept { return tumble_store_erase(&state_); }
};

/** A listener of events: anything that can be called with one and is noexcept. It is used within the call alone. */
template <typename Listener>
tumble_on_event listener_of() noexcept
{
    static_assert(noexcept(std::declval<Listener &>()(std::declval<const tumble_event &>())),
                  "an exception may not pass through the library");
    return [](void *context, const tumble_event *event) noexcept {
        (*static_cast<std::remove_reference_t<Listener> *>(context))(*event);
    };
}

/** A primary and its secondaries. */
class redundancy : public detail::owner<tumble_redundancy> {
public:
    redundancy(const tumble_redundancy_settings &settings, span<const tumble_unit> units,
               const tumble_calibration *calibration = nullptr) noexcept
    {
        status_ = tumble_redundancy_init(&state_, sizeof state_, &settings, calibration, units.data(), units.size());
    }

    template <typename Listener>
    result<tumble_output> push(std::uint32_t unit, const tumble_sample &sample, Listener &&listener) noexcept
    {
        return detail::answered<tumble_output>([&](tumble_output *output) {
            return tumble_redundancy_push(&state_, unit, &sample, listener_of<Listener>(), &listener, output);
        });
    }

    result<tumble_output> push(std::uint32_t unit, const tumble_sample &sample) noexcept
    {
        return detail::answered<tumble_output>([&](tumble_output *output) {
            return tumble_redundancy_push(&state_, unit, &sample, nullptr, nullptr, output);
        });
    }

    [[nodiscard]] tumble_status set_temperature(std::uint32_t unit, float temperature) noexcept
    {
        return tumble_redundancy_set_temperature(&state_, unit, temperature);
    }

    [[nodiscard]] tumble_status command(tumble_command command) noexcept
    {
        return tumble_redundancy_command(&state_, command);
    }

    /** The unit from which the output comes; #TUMBLE_NO_SOURCE if from none. */
    result<std::uint32_t> source() const noexcept
    {
        return detail::answered<std::uint32_t>(
            [this](std::uint32_t *unit) { return tumble_redundancy_get_source(&state_, unit); });
    }

    result<tumble_knowledge> stored(std::uint32_t unit, tumble_sensor sensor) const noexcept
    {
        return detail::answered<tumble_knowledge>([&](tumble_knowledge *stored) {
            return tumble_redundancy_get_stored(&state_, unit, sensor, stored);
        });
    }

    [[nodiscard]] tumble_status restore(const tumble_record &record) noexcept
    {
        return tumble_redundancy_restore(&state_, &record, nullptr, nullptr);
    }

    [[nodiscard]] tumble_status restore_from(store &from) noexcept
    {
        return tumble_redundancy_restore_from(&state_, from.get(), nullptr, nullptr);
    }
};

/** A robot that stands still, then turns on the spot. */
class spin : public detail::owner<tumble_spin> {
public:
    explicit spin(const tumble_spin_settings &settings) noexcept
    {
        status_ = tumble_spin_init(&state_, sizeof state_, &settings);
    }

    [[nodiscard]] tumble_status start() noexcept { return tumble_spin_start(&state_); }

    result<tumble_spin_event> push(const tumble_sample &sample, tumble_wheels wheels) noexcept
    {
        return detail::answered<tumble_spin_event>(
            [&](tumble_spin_event *event) { return tumble_spin_push(&state_, &sample, wheels, event); });
    }

    result<tumble_spin_event> tick(std::uint64_t now) noexcept
    {
        return detail::answered<tumble_spin_event>(
            [&](tumble_spin_event *event) { return tumble_spin_tick(&state_, now, event); });
    }

    result<tumble_spin_event> work() noexcept
    {
        return detail::answered<tumble_spin_event>(
            [this](tumble_spin_event *event) { return tumble_spin_work(&state_, event); });
    }

    result<tumble_spin_progress> progress() const noexcept
    {
        return detail::answered<tumble_spin_progress>(
            [this](tumble_spin_progress *progress) { return tumble_spin_get_progress(&state_, progress); });
    }

    result<tumble_spin_estimate> solve(const tumble_spin_true_angle *true_angle = nullptr,
                                       tumble_spin_failure *failure = nullptr) noexcept
    {
        return detail::answered<tumble_spin_estimate>([&](tumble_spin_estimate *estimate) {
            return tumble_spin_solve(&state_, true_angle, estimate, failure);
        });
    }
};

/** Settings of a redundant set with their defaults. */
inline result<tumble_redundancy_settings> redundancy_defaults() noexcept
{
    return detail::answered<tumble_redundancy_settings>(tumble_redundancy_defaults);
}

/** Settings of a spin with their defaults for a grade. */
inline result<tumble_spin_settings> spin_defaults(tumble_grade grade = TUMBLE_GRADE_CONSUMER) noexcept
{
    return detail::answered<tumble_spin_settings>(
        [grade](tumble_spin_settings *settings) { return tumble_spin_defaults_for_grade(settings, grade); });
}

/** A unit with six axes, mounted as the primary. */
inline result<tumble_unit> unit_defaults(std::uint64_t identity) noexcept
{
    return detail::answered<tumble_unit>(
        [identity](tumble_unit *unit) { return tumble_unit_defaults(unit, identity); });
}

/** Writes a record as bytes; gives those that are it. */
inline result<span<std::uint8_t>> encode(const tumble_record &record, span<std::uint8_t> bytes) noexcept
{
    std::size_t length = 0;
    const tumble_status status = tumble_record_encode(&record, bytes.data(), bytes.size(), &length);
    return {status, bytes.first(length)};
}

/** Reads a record from the bytes that are it. */
inline result<tumble_record> decode(span<const std::uint8_t> bytes) noexcept
{
    return detail::answered<tumble_record>(
        [&](tumble_record *record) { return tumble_record_decode(bytes.data(), bytes.size(), record); });
}

/** A calibration as it is applied to samples. */
inline result<tumble_correction> correction_of(const tumble_calibration &calibration) noexcept
{
    return detail::answered<tumble_correction>(
        [&](tumble_correction *correction) { return tumble_correction_init(correction, &calibration); });
}

/** A sample of a sensor without the errors that its calibration states. */
inline result<tumble_sample> corrected(const tumble_correction &correction, const tumble_sample &reading) noexcept
{
    return detail::answered<tumble_sample>(
        [&](tumble_sample *truth) { return tumble_correction_apply(&correction, &reading, truth); });
}

/** Writes the error of a magnetometer as bytes; gives those that are it. */
inline result<span<std::uint8_t>> encode(const tumble_magnetometer_record &record, span<std::uint8_t> bytes) noexcept
{
    const tumble_status status = tumble_magnetometer_encode(&record, bytes.data(), bytes.size());
    return {status, bytes.first(status == TUMBLE_OK ? TUMBLE_MAGNETOMETER_BYTES : 0)};
}

/** Reads the error of a magnetometer from the bytes that are it. */
inline result<tumble_magnetometer_record> decode_magnetometer(span<const std::uint8_t> bytes) noexcept
{
    return detail::answered<tumble_magnetometer_record>([&](tumble_magnetometer_record *record) {
        return tumble_magnetometer_decode(bytes.data(), bytes.size(), record);
    });
}

/** The errors of a magnetometer as they are taken off its readings. */
inline result<tumble_magnetometer_correction> correction_of(const tumble_magnetometer &magnetometer) noexcept
{
    return detail::answered<tumble_magnetometer_correction>([&](tumble_magnetometer_correction *correction) {
        return tumble_magnetometer_correction_init(correction, &magnetometer);
    });
}

/** Field in the case frame of the unit, uT, from a reading, uT, at a current, A, or a throttle from 0 to 1. */
inline result<std::array<float, 3>> corrected(const tumble_magnetometer_correction &correction,
                                              const std::array<float, 3> &reading, float current = 0.0F) noexcept
{
    return detail::answered<std::array<float, 3>>([&](std::array<float, 3> *field) {
        return tumble_magnetometer_correction_apply(&correction, reading.data(), current, field->data());
    });
}

} // namespace tumble

#endif
