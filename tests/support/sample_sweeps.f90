!> Sweeps whose results are functions of the number of the variant.
module sample_sweeps
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use nocdyn_kinds, only: wp
  use nocdyn_sweep_chunk, only: allocate_chunk, chunk_t, status_done, status_failed, status_refused
  use nocdyn_sweep_header, only: stored_quantity_t, sweep_header_t
  use nocdyn_text, only: to_text
  implicit none (type, external)
  private

  public :: header_of, sample_chunk, sample_result, are_equal

  integer, parameter, public :: varied = 2, statistics = 3

contains

  !> Header of the shard from `first` to `last`.
  function header_of(first, last, variants) result(header)
    integer, intent(in) :: first, last, variants
    type(sweep_header_t) :: header

    header%title = 'A sample'
    header%source = 'nocdyn 9'
    header%design = 'random'
    header%seed = 42
    header%input_file = 'in/sample.nml'
    header%input_text = '&body name = ''a'' /' // new_line('a') // '&sweep design = ''random'' /' // new_line('a')
    header%list_checksum = ''
    header%variants = variants
    header%first = first
    header%last = last
    allocate (header%parameters(varied), header%results(statistics))
    call name_quantity(header%parameters(1), 'load.work.viscous', 'N m s/rad', 'viscous of load ''work''')
    call name_quantity(header%parameters(2), 'gear.a/b.radii(2)', 'm', 'radii(2) of gear ''a/b''')
    call name_quantity(header%results(1), 'omega_motor_final', 'rad/s', 'speed of ''motor'' at the end')
    call name_quantity(header%results(2), 'moment_a_b_max', 'N m', 'largest moment of ''a_b''')
    call name_quantity(header%results(3), 'moment_a/b_max', 'N m', 'largest moment of ''a/b''')
  end function header_of

  subroutine name_quantity(quantity, label, unit, long_name)
    type(stored_quantity_t), intent(inout) :: quantity
    character(len=*), intent(in) :: label, unit, long_name
    integer :: k

    quantity%label = label
    quantity%unit = unit
    quantity%long_name = long_name
    do k = 1, size(quantity%facts)
      quantity%facts(k)%text = label(:k)
    end do
  end subroutine name_quantity

  !> Result `k` of a variant, of either sign and of very different sizes.
  pure real(wp) function sample_result(variant, k)
    integer, intent(in) :: variant, k

    sample_result = sin(real(variant * k, wp)) * 10.0_wp**modulo(variant, 7 * k)
  end function sample_result

  !> Some consecutive variants; every fifth is refused, every seventh fails.
  function sample_chunk(first, count) result(chunk)
    integer, intent(in) :: first, count
    type(chunk_t) :: chunk
    integer :: i, k, variant

    call allocate_chunk(chunk, first, count, varied, statistics)
    do i = 1, count
      variant = first - 1 + i
      chunk%parameters(:, i) = [0.1_wp, -1.0_wp / 3] * variant
      chunk%results(:, i) = [(sample_result(variant, k), k=1, statistics)]
      chunk%steps(i) = variant + 100
      if (modulo(variant, 5) == 0) then
        chunk%status(i) = status_refused
        chunk%reasons(i)%text = 'variant ' // to_text(variant) // ' is "refused", and why'
      else if (modulo(variant, 7) == 0) then
        chunk%status(i) = status_failed
        chunk%reasons(i)%text = 'too many steps'
      end if
      if (chunk%status(i) /= status_done) chunk%results(:, i) = ieee_value(0.0_wp, ieee_quiet_nan)
    end do
  end function sample_chunk

  !> Whether two chunks are the same to the last bit.
  function are_equal(a, b)
    type(chunk_t), intent(in) :: a, b
    logical :: are_equal
    integer :: i

    are_equal = a%first == b%first .and. a%count == b%count
    if (.not. are_equal) return
    are_equal = all(a%status == b%status) .and. all(a%steps == b%steps) .and. all(same(a%parameters, b%parameters)) .and. &
                all(same(a%results, b%results))
    do i = 1, a%count
      if (a%status(i) == status_done) cycle
      are_equal = are_equal .and. a%reasons(i)%text == b%reasons(i)%text
    end do
  end function are_equal

  elemental logical function same(x, y)
    real(wp), intent(in) :: x, y

    same = all(transfer(x, [0]) == transfer(y, [0]))
  end function same

end module sample_sweeps
