!> The description of a sweep in its files: input, program, and the names of parameters and results.
module nocdyn_sweep_header
  use nocdyn_bytes, only: byte_reader_t, integer_bytes, put_integers, put_reals, put_text, real_bytes
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: string_t, to_text
  implicit none (type, external)
  private

  public :: pack_header, unpack_header

  character(len=*), parameter, public :: sweep_netcdf_name = 'sweep.nc'

  !> What is known of the signal that a result is of.
  character(len=*), parameter, public :: fact_names(*) = [character(len=12) :: 'kind', 'statistic', 'element_kind', 'element', &
                                                          'point', 'caption', 'positive']

  !> A target or a result.
  type, public :: stored_quantity_t
    character(len=:), allocatable :: label       !! 'load.work.viscous', 'omega_motor_final'
    character(len=:), allocatable :: unit        !! '' if it has none
    character(len=:), allocatable :: long_name
    type(string_t) :: facts(size(fact_names))    !! by `fact_names`; '': none
    integer :: point = 0                         !! of a curve: which of the points of the axis it is at; 0: of no curve
  contains
    procedure :: curve
  end type stored_quantity_t

  !> What curves are over: the speeds of a body, or the frequencies of a shaker.
  type, public :: curve_axis_t
    character(len=:), allocatable :: label         !! 'omega_motor', 'frequency'
    character(len=:), allocatable :: unit
    real(wp), allocatable :: points(:)             !! in this unit; not allocated: no curve is kept
  contains
    procedure :: points_in_use
  end type curve_axis_t

  type, public :: sweep_header_t
    character(len=:), allocatable :: title
    character(len=:), allocatable :: source             !! program, version and compiler
    character(len=:), allocatable :: design             !! e.g. 'random'
    character(len=:), allocatable :: input_file         !! as given on the command line
    character(len=:), allocatable :: input_text         !! the complete input in its normal form
    character(len=:), allocatable :: list_checksum      !! of the file with the list of variants, '' if there is none
    integer :: seed = 0
    integer :: variants = 0                             !! of the whole sweep
    integer :: first = 1, last = 0                      !! variants of this shard
    type(stored_quantity_t), allocatable :: parameters(:)
    type(stored_quantity_t), allocatable :: results(:)  !! the points of a curve one after the other
    type(curve_axis_t) :: axis
  end type sweep_header_t

contains

  !> The label of the curve that a result is a point of, which is that of the result without the number of the point.
  pure function curve(self) result(name)
    class(stored_quantity_t), intent(in) :: self
    character(len=:), allocatable :: name

    name = self%label(:len(self%label) - len(to_text(self%point)) - 1)
  end function curve

  !> Number of the points, 0 if there is no curve.
  pure integer function points_in_use(self)
    class(curve_axis_t), intent(in) :: self

    points_in_use = 0
    if (allocated(self%points)) points_in_use = size(self%points)
  end function points_in_use

  !> Packs a header into bytes, which `unpack_header` reads.
  subroutine pack_header(header, bytes)
    type(sweep_header_t), intent(in) :: header
    character(len=:), allocatable, intent(out) :: bytes
    integer :: used

    used = 0
    associate (parameters => header%parameters, results => header%results)
      call put_integers(bytes, used, [header%seed, header%variants, header%first, header%last, size(parameters), size(results)])
      call put_text(bytes, used, header%title)
      call put_text(bytes, used, header%source)
      call put_text(bytes, used, header%design)
      call put_text(bytes, used, header%input_file)
      call put_text(bytes, used, header%input_text)
      call put_text(bytes, used, header%list_checksum)
      call put_quantities(bytes, used, parameters)
      call put_quantities(bytes, used, results)
    end associate
    associate (axis => header%axis)
      call put_integers(bytes, used, [axis%points_in_use()])
      if (axis%points_in_use() > 0) then
        call put_text(bytes, used, axis%label)
        call put_text(bytes, used, axis%unit)
        call put_reals(bytes, used, reshape(axis%points, [size(axis%points), 1]))
      end if
    end associate
    bytes = bytes(:used)
  end subroutine pack_header

  subroutine put_quantities(bytes, used, quantities)
    character(len=:), allocatable, intent(inout) :: bytes
    integer, intent(inout) :: used
    type(stored_quantity_t), intent(in) :: quantities(:)
    integer :: i, k

    do i = 1, size(quantities)
      call put_text(bytes, used, quantities(i)%label)
      call put_text(bytes, used, quantities(i)%unit)
      call put_text(bytes, used, quantities(i)%long_name)
      do k = 1, size(fact_names)
        call put_text(bytes, used, quantities(i)%facts(k)%text)
      end do
      call put_integers(bytes, used, [quantities(i)%point])
    end do
  end subroutine put_quantities

  !> Unpacks a header.
  subroutine unpack_header(bytes, header, is_whole)
    character(len=*), intent(in) :: bytes
    type(sweep_header_t), intent(out) :: header
    logical, intent(out) :: is_whole              !! whether the bytes are the ones of a header
    type(byte_reader_t) :: reader
    integer :: numbers(6)

    call reader%take_integers(bytes, numbers)
    header%seed = numbers(1)
    header%variants = numbers(2)
    header%first = numbers(3)
    header%last = numbers(4)
    call reader%take_text(bytes, header%title)
    call reader%take_text(bytes, header%source)
    call reader%take_text(bytes, header%design)
    call reader%take_text(bytes, header%input_file)
    call reader%take_text(bytes, header%input_text)
    call reader%take_text(bytes, header%list_checksum)
    call take_quantities(reader, bytes, numbers(5), header%parameters)
    call take_quantities(reader, bytes, numbers(6), header%results)
    call take_axis(reader, bytes, header%axis)
    is_whole = .not. reader%is_short .and. reader%next == len(bytes) + 1
  end subroutine unpack_header

  subroutine take_axis(reader, bytes, axis)
    type(byte_reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: bytes
    type(curve_axis_t), intent(out) :: axis
    integer :: points(1)
    real(wp), allocatable :: values(:, :)

    call reader%take_integers(bytes, points)
    if (points(1) < 1) return
    call reader%take_text(bytes, axis%label)
    call reader%take_text(bytes, axis%unit)
    allocate (values(min(points(1), len(bytes) / real_bytes), 1))   ! damaged bytes can give any count
    call reader%take_reals(bytes, values)
    axis%points = values(:, 1)
  end subroutine take_axis

  subroutine take_quantities(reader, bytes, count, quantities)
    type(byte_reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: bytes
    integer, intent(in) :: count
    type(stored_quantity_t), allocatable, intent(out) :: quantities(:)
    integer :: i, k, point(1)

    ! damaged bytes can give any count: no more than they can hold
    allocate (quantities(max(0, min(count, len(bytes) / (3 * integer_bytes)))))
    do i = 1, size(quantities)
      call reader%take_text(bytes, quantities(i)%label)
      call reader%take_text(bytes, quantities(i)%unit)
      call reader%take_text(bytes, quantities(i)%long_name)
      do k = 1, size(fact_names)
        call reader%take_text(bytes, quantities(i)%facts(k)%text)
      end do
      call reader%take_integers(bytes, point)
      quantities(i)%point = point(1)
    end do
  end subroutine take_quantities

end module nocdyn_sweep_header
