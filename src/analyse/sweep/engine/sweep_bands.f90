!> The bands of a sweep: quantiles of its curves over the speed, with the curves of the machine of the input, as a table.
module nocdyn_sweep_bands
  use nocdyn_csv, only: put_known, write_header
  use nocdyn_errors, only: error_t
  use nocdyn_finite, only: is_finite
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_nominal_curves, only: nominal_curves_t
  use nocdyn_order_statistics, only: order_statistics_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_sweep_header, only: fact_names, stored_quantity_t, sweep_header_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  public :: new_bands

  character(len=*), parameter, public :: bands_file = 'bands.csv'
  character(len=*), parameter :: statistic_words(*) = [character(len=8) :: 'nominal', 'min', 'p5', 'p25', 'median', 'p75', &
                                                       'p95', 'max', 'variants', 'limit']

  !> A column of the table.
  type :: band_column_t
    integer :: result = 0                         ! the first point of its curve; 0: of a line
    character(len=:), allocatable :: name         ! of the curve or line
    character(len=:), allocatable :: statistic    ! of `statistic_words`; 'line'
    character(len=:), allocatable :: unit
    real(wp), allocatable :: values(:)            ! NaN: not known; [points]
  end type band_column_t

  type, public :: sweep_bands_t
    type(string_t), allocatable :: curves(:)      !! their labels
    character(len=:), allocatable :: axis_label   !! of the first column, with its unit
    real(wp), allocatable :: axis(:)              !! [points]
    type(band_column_t), allocatable, private :: columns(:)
  contains
    procedure :: write_table, put_columns
  end type sweep_bands_t

contains

  !> The bands of the results of a sweep.
  subroutine new_bands(header, nominal, statistics, self)
    type(sweep_header_t), intent(in) :: header                !! with an axis
    type(nominal_curves_t), intent(in) :: nominal
    type(order_statistics_t), intent(in) :: statistics(:)     !! of all results
    type(sweep_bands_t), intent(out) :: self
    integer :: c, first, i, k, l, points

    points = size(header%axis%points)
    self%axis_label = header%axis%label // ' [' // header%axis%unit // ']'
    allocate (self%axis, source=header%axis%points)
    allocate (self%curves(count(header%results%point == 1)))
    allocate (self%columns(size(self%curves) * size(statistic_words) + size(nominal%lines)))
    c = 0
    k = 0
    do first = 1, size(header%results)
      if (header%results(first)%point /= 1) cycle
      self%curves(c + 1)%text = header%results(first)%curve()
      do i = 1, size(statistic_words)
        k = k + 1
        call set_column(header%results(first), first, trim(statistic_words(i)), self%columns(k))
        associate (range => nominal_range(c, points))
          self%columns(k)%values = values_of(i, statistics(first:first + points - 1), nominal%values(range(1):range(2)), &
                                             nominal%limits(range(1):range(2)))
        end associate
      end do
      c = c + 1
    end do
    do l = 1, size(nominal%lines)
      k = k + 1
      self%columns(k)%name = nominal%lines(l)%text
      self%columns(k)%statistic = 'line'
      self%columns(k)%unit = 'Hz'
      self%columns(k)%values = nominal%frequencies(:, l)
    end do
    call leave_out_empty(self%columns)
  end subroutine new_bands

  !> Drops columns without any number.
  subroutine leave_out_empty(columns)
    type(band_column_t), allocatable, intent(inout) :: columns(:)
    type(band_column_t), allocatable :: kept(:)
    logical :: has_numbers(size(columns))
    integer :: k, n

    has_numbers = [(any(is_finite(columns(k)%values)), k=1, size(columns))]
    allocate (kept(count(has_numbers)))
    n = 0
    do k = 1, size(columns)
      if (.not. has_numbers(k)) cycle
      n = n + 1
      kept(n) = columns(k)
    end do
    call move_alloc(kept, columns)
  end subroutine leave_out_empty

  !> The first and the last point of a curve among the points of all curves.
  pure function nominal_range(before, points) result(range)
    integer, intent(in) :: before   !! curves
    integer, intent(in) :: points   !! of each
    integer :: range(2)

    range = [before * points + 1, (before + 1) * points]
  end function nominal_range

  subroutine set_column(quantity, first, statistic, column)
    type(stored_quantity_t), intent(in) :: quantity   !! first point of the curve
    integer, intent(in) :: first                      !! number of that result
    character(len=*), intent(in) :: statistic
    type(band_column_t), intent(out) :: column

    column%result = first
    column%name = quantity%curve()
    column%statistic = statistic
    column%unit = quantity%unit
    if (statistic == 'variants') column%unit = '1'
  end subroutine set_column

  !> A statistic over the points of a curve.
  pure function values_of(statistic, over_variants, nominal, limits) result(values)
    integer, intent(in) :: statistic                           !! of `statistic_words`
    type(order_statistics_t), intent(in) :: over_variants(:)   !! [points]
    real(wp), intent(in) :: nominal(:), limits(:)              !! [points]
    real(wp) :: values(size(over_variants))

    select case (trim(statistic_words(statistic)))
    case ('nominal')
      values = nominal
    case ('min')
      values = over_variants%minimum
    case ('p5')
      values = over_variants%low
    case ('p25')
      values = over_variants%lower_quartile
    case ('median')
      values = over_variants%median
    case ('p75')
      values = over_variants%upper_quartile
    case ('p95')
      values = over_variants%high
    case ('max')
      values = over_variants%maximum
    case ('variants')
      values = over_variants%count
    case default   ! limit
      values = limits
    end select
  end function values_of

  !> Writes the table: a row for each speed. A cell is empty where no variant has a number.
  subroutine write_table(self, folder, error)
    class(sweep_bands_t), intent(in) :: self
    character(len=*), intent(in) :: folder
    type(error_t), allocatable, intent(out) :: error
    type(output_file_t) :: file
    type(string_t) :: labels(size(self%columns) + 1)
    integer :: i, k

    labels(1)%text = self%axis_label
    do k = 1, size(self%columns)
      labels(k + 1)%text = label_of(self%columns(k))
    end do
    call file%open(folder, bands_file)
    call write_header(file, labels)
    do i = 1, size(self%axis)
      call file%put_numbers(self%axis(i:i), '')
      call put_known(file, [(self%columns(k)%values(i), k=1, size(self%columns))])
      call file%put(new_line('a'))
    end do
    call file%finish(bands_file, error)
  end subroutine write_table

  !> "total_moment_shaft_curve_p95 [N m]".
  pure function label_of(column) result(label)
    type(band_column_t), intent(in) :: column
    character(len=:), allocatable :: label

    label = column%name
    if (column%result > 0) label = label // '_' // column%statistic
    label = label // ' [' // column%unit // ']'
  end function label_of

  !> Writes what the columns of the table are into an open list.
  subroutine put_columns(self, header, json)
    class(sweep_bands_t), intent(in) :: self
    type(sweep_header_t), intent(in) :: header
    type(json_t), intent(inout) :: json
    character(len=:), allocatable :: fact
    integer :: f, k

    do k = 1, size(self%columns)
      associate (one => self%columns(k))
        call json%open()
        call json%put('label', label_of(one))
        call json%put('file', bands_file)
        call json%put('name', one%name)
        do f = 1, size(fact_names)
          fact = ''
          if (one%result > 0) fact = header%results(one%result)%facts(f)%text
          if (fact_names(f) == 'statistic') fact = one%statistic
          call json%put(trim(fact_names(f)), fact)
        end do
        call json%put('unit', one%unit)
        if (one%result > 0) call json%put('long_name', header%results(one%result)%long_name)
        call json%close()
      end associate
    end do
  end subroutine put_columns

end module nocdyn_sweep_bands
